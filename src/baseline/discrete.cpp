#include "baseline/discrete.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "baseline/full.h"
#include "mesh/distance/distance.h"
#include "mesh/packed_vertices.h"

namespace lodestone {

namespace {

constexpr size_t least_triangles = 64;
constexpr double least_shrink = 0.9;  // of a level against the one before, or the chain ends

struct Store {
    std::shared_ptr<const void> vertices_owner;
    std::vector<std::vector<uint32_t>> indices;
};

struct LevelRecord {
    uint64_t first_index, index_count;
    double max_error, rms_error;
};

// A level as a mesh of positions alone, for measuring.
TriMesh bare_mesh(std::span<const MeshVertex> vertices, std::span<const uint32_t> indices) {
    TriMesh mesh;
    for (const MeshVertex& v : vertices) mesh.positions.emplace_back(v.position[0], v.position[1], v.position[2]);
    mesh.set_identity_wedges();
    for (size_t i = 0; i + 2 < indices.size(); i += 3)
        mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    drop_unreferenced(mesh);
    return mesh;
}

}  // namespace

DiscreteChain source_chain(const TriMesh& mesh) {
    std::vector<uint32_t> indices;
    for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    const FixedLevels full = full_level(pack_vertices(mesh), indices, pack_further(mesh));
    return {full.vertices, full.further, {{full.levels[0].indices, 0, 0}}, full.owner};
}

Result<DiscreteChain> make_discrete_chain(const TriMesh& mesh, const Progress& progress) {
    const DiscreteChain full = source_chain(mesh);
    const auto store = std::make_shared<Store>();
    store->vertices_owner = full.owner;
    DiscreteChain chain;
    chain.vertices = full.vertices;
    chain.further = full.further;
    chain.owner = store;

    store->indices.emplace_back(full.levels[0].indices.begin(), full.levels[0].indices.end());
    const size_t source_triangles = store->indices[0].size() / 3;
    while (store->indices.back().size() / 3 > least_triangles) {
        const size_t triangles = store->indices.back().size() / 3;
        progress.at("discrete chain", 1 - static_cast<double>(triangles) / static_cast<double>(source_triangles));
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        const std::vector<uint32_t>& finer = store->indices.back();
        const size_t wanted = std::max(finer.size() / 6, least_triangles) * 3;
        std::vector<uint32_t> coarser(finer.size());
        coarser.resize(meshopt_simplify(coarser.data(), finer.data(), finer.size(), chain.vertices[0].position,
                                        chain.vertices.size(), sizeof(MeshVertex), wanted, 1e9f, 0, nullptr));
        if (coarser.empty() || static_cast<double>(coarser.size()) > least_shrink * static_cast<double>(finer.size()))
            break;
        meshopt_optimizeVertexCache(coarser.data(), coarser.data(), coarser.size(), chain.vertices.size());
        store->indices.push_back(std::move(coarser));
    }

    DistanceOptions distance;
    distance.samples = 100000;
    distance.vertices = 2 * distance.samples;
    const MeasuredSurface source(bare_mesh(chain.vertices, store->indices[0]), distance);
    chain.levels.push_back({store->indices[0], 0, 0});
    double largest = 0;
    for (size_t i = 1; i < store->indices.size(); ++i) {
        progress.at("measure discrete levels", static_cast<double>(i) / static_cast<double>(store->indices.size()));
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        distance.seed = mix64(1 + i);
        const MeasuredSurface level(bare_mesh(chain.vertices, store->indices[i]), distance);
        const SurfaceDistance there = source.to(level), back = level.to(source);
        largest = std::max({largest, there.max, back.max});
        chain.levels.push_back({store->indices[i], largest * sampling_margin, std::max(there.rms, back.rms)});
    }
    return chain;
}

Result<void> DiscreteChain::write_chunks(ChunkWriter& writer, const std::string& room) const {
    std::vector<LevelRecord> records;
    std::vector<uint32_t> indices;
    for (const DiscreteLevel& level : levels) {
        records.push_back({indices.size(), level.indices.size(), level.max_error, level.rms_error});
        indices.insert(indices.end(), level.indices.begin(), level.indices.end());
    }
    if (auto done = writer.add_array(room + "/vertices", vertices); !done) return done;
    if (!further.empty()) {
        if (auto done = writer.add_array(room + "/further", further); !done) return done;
    }
    if (auto done = writer.add_array(room + "/indices", std::span<const uint32_t>(indices)); !done) return done;
    return writer.add_array(room + "/levels", std::span<const LevelRecord>(records));
}

Result<DiscreteChain> DiscreteChain::open(const ChunkFile& file, size_t materials, const std::string& room) {
    const auto wrong = [&](const char* what) {
        return fail(Fault::format, file.path().string() + ": " + room + "/levels: " + what + "; bake the asset again");
    };
    auto vertices = file.array<MeshVertex>(room + "/vertices");
    if (!vertices) return tl::unexpected(vertices.error());
    auto indices = file.array<uint32_t>(room + "/indices");
    if (!indices) return tl::unexpected(indices.error());
    auto records = file.array<LevelRecord>(room + "/levels");
    if (!records) return tl::unexpected(records.error());
    DiscreteChain chain;
    chain.vertices = *vertices;
    if (const std::string name = room + "/further"; file.contains(name)) {
        auto further = file.array<FurtherAttributes>(name);
        if (!further) return tl::unexpected(further.error());
        if (further->size() != vertices->size()) return wrong("further attributes are not as many as vertices");
        chain.further = *further;
    }
    chain.owner = std::make_shared<ChunkFile>(file);
    uint64_t end = 0;
    for (const LevelRecord& r : *records) {
        if (r.first_index != end || r.index_count > indices->size() - end || r.index_count > ~0u)
            return wrong("levels do not lie behind one another");
        end += r.index_count;
        chain.levels.push_back({indices->subspan(r.first_index, r.index_count), r.max_error, r.rms_error});
    }
    if (auto valid = chain.validate(); !valid) return wrong(valid.error().message.c_str());
    for (const MeshVertex& v : chain.vertices) {
        if (v.material >= materials) return wrong("a material is out of range");
        if (!std::isfinite(v.position[0]) || !std::isfinite(v.position[1]) || !std::isfinite(v.position[2]))
            return wrong("a position is no number");
    }
    return chain;
}

Result<void> DiscreteChain::validate() const {
    if (levels.empty()) return fail(Fault::invariant, "the chain has no level");
    for (size_t i = 0; i < levels.size(); ++i) {
        const DiscreteLevel& level = levels[i];
        if (level.indices.size() % 3 != 0)
            return fail(Fault::invariant,
                        "level " + std::to_string(i) + " has an index count that is no multiple of 3");
        for (const uint32_t index : level.indices) {
            if (index >= vertices.size())
                return fail(Fault::invariant, "level " + std::to_string(i) + " has an index out of range");
        }
        if (!std::isfinite(level.max_error) || !std::isfinite(level.rms_error) || level.max_error < 0)
            return fail(Fault::invariant, "the error of level " + std::to_string(i) + " is no number");
        if (i == 0) continue;
        if (!(level.max_error >= levels[i - 1].max_error))
            return fail(Fault::invariant,
                        "the error of level " + std::to_string(i) + " is below that of the one before");
        if (level.indices.size() >= levels[i - 1].indices.size())
            return fail(Fault::invariant, "level " + std::to_string(i) + " is no smaller than the one before");
    }
    return {};
}

FixedLevels fixed_levels_of(std::shared_ptr<const DiscreteChain> chain) {
    FixedLevels levels;
    levels.vertices = chain->vertices;
    levels.further = chain->further;
    for (const DiscreteLevel& level : chain->levels) levels.levels.push_back({level.indices, level.max_error});
    levels.owner = std::move(chain);
    return levels;
}

}  // namespace lodestone
