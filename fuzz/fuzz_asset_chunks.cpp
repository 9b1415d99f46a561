// The openers of assets, with every hash and checksum right: the first two bytes choose a chunk of one of some small
// sound assets and whether the rest replaces its content or damages it. Or the file itself is damaged, or cut. What
// opens is played, extracted and decoded.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "baseline/discrete.h"
#include "fuzz/atlas_file.h"
#include "fuzz/mutators.h"
#include "fuzz/promise.h"
#include "fuzz/random_mesh.h"
#include "fuzz/watch.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/generate.h"
#include "mesh/io/material_chunks.h"
#include "mesh/repair.h"
#include "tests/fixtures/block_sums.h"
#include "vgi/asset/atlas_chunks.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/pages.h"
#include "vgi/bake/bake.h"
#include "vgi/extract/extract.h"

using namespace lodestone;

namespace {

void check(bool good) { fuzz::require(good, "a sound asset is made, written and opened"); }

using Bytes = std::vector<std::byte>;
struct Chunk {
    std::string name;
    Bytes content;
};

const std::filesystem::path& path_of_asset() {
    static const std::filesystem::path path = "/dev/shm/lodestone-fuzz-" + std::to_string(getpid()) + ".lode";
    return path;
}

// The same with texture coordinates, colours, and two materials with textures.
TriMesh painted(TriMesh mesh) {
    Material material;
    for (Texture* texture : material.textures()) *texture = {0, {Wrap::repeat, Wrap::clamp}};
    material.alpha_mode = AlphaMode::mask;
    mesh.material_table = {material, Material{}};
    mesh.images = {Image{2, 2, std::vector<glm::u8vec4>(4, {9, 8, 7, 255})}};
    mesh.uvs.clear();
    for (uint32_t w = 0; w < mesh.wedge_count(); ++w) {
        const glm::vec3 p = mesh.positions[mesh.wedge_vertex[w]];
        mesh.uvs.emplace_back(p);
        mesh.colours.emplace_back(static_cast<uint8_t>(w));
        mesh.materials.push_back(p.y > 0);
    }
    return mesh;
}

// The same and, beside it, triangles around two vertices: more than their splits are coded by number for.
TriMesh with_fans(TriMesh mesh) {
    mesh.uvs.clear();
    mesh.normals.clear();
    fuzz::add_fan(mesh, 80, true, {5, 0, 0});
    compute_normals(mesh);
    return mesh;
}

// Every backend's part of an asset of a mesh. cells: of a chart; a page has at most page_cells.
std::vector<Chunk> chunks_of(TriMesh mesh, uint32_t cells, bool leaves) {
    check(repair(mesh).has_value());
    vgi::AtlasOptions options;
    options.clusters.clusters = 1;
    options.cells = cells;
    options.error_samples = 500;
    options.leaves = leaves;
    vgi::AtlasReport report;
    const auto atlas = vgi::make_atlas(mesh, options, report);
    // Of two sets of texture coordinates an atlas would keep none.
    mesh.second_uvs = mesh.uvs;
    for (Material& material : mesh.material_table) material.emission_texture.second = material.emission_texture.there();
    for (size_t w = 0; w < mesh.wedge_count(); ++w)
        mesh.tangents.push_back(w % 5 == 0 ? glm::vec4(0) : glm::vec4(0, 1, 0, w % 2 == 0 ? 1 : -1));
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    check(list.has_value());
    auto pm = bake_progressive_mesh(mesh, *list, {"keyframe", "greedy", "classic"});
    check(pm.has_value());
    const auto chain = make_discrete_chain(mesh);
    check(atlas && chain);
    {
        auto writer = ChunkWriter::create(path_of_asset(), {});
        check(pm->write_chunks(*writer) && vgi::write_chunks(*atlas, *writer) && chain->write_chunks(*writer));
        check(writer->commit().has_value());
    }
    const auto file = ChunkFile::open(path_of_asset());
    std::vector<Chunk> chunks;
    for (const ChunkInfo& info : file->chunks()) {
        const auto bytes = *file->bytes(info.name);
        chunks.push_back({info.name, Bytes(bytes.begin(), bytes.end())});
    }
    std::filesystem::remove(path_of_asset());
    return chunks;
}

const Bytes& content_of(const std::vector<Chunk>& chunks, const std::string& name) {
    for (const Chunk& chunk : chunks) {
        if (chunk.name == name) return chunk.content;
    }
    fuzz::broken("an asset has the chunk " + name);
}

template <class T>
Bytes content_from(const std::vector<T>& from) {
    const auto bytes = std::as_bytes(std::span(from));
    return {bytes.begin(), bytes.end()};
}

// Makes the checksums right that the asset holds of what a chunk's content has become.
void mend_sums(std::vector<Chunk>& chunks, const Chunk& changed) {
    Chunk sums;
    if (changed.name == "lod/blocks")
        sums = {"lod/table", content_from(fixtures::with_right_sums(content_of(chunks, "lod/table"), changed.content))};
    for (const auto& [bytes, ends, name] :
         {std::array{"vgi/geometry_pages", "vgi/geometry_ends", "vgi/geometry_sums"},
          std::array{"vgi/attribute_pages", "vgi/attribute_ends", "vgi/attribute_sums"},
          std::array{"vgi/leaf_parts", "vgi/leaf_ends", "vgi/leaf_sums"}}) {
        if (changed.name == bytes)
            sums = {name, content_from(fixtures::right_sums(content_of(chunks, ends), changed.content))};
    }
    for (Chunk& chunk : chunks) {
        if (chunk.name == sums.name) chunk.content = std::move(sums.content);
    }
}

void write(const std::vector<Chunk>& chunks) {
    auto writer = ChunkWriter::create(path_of_asset(), {});
    for (const Chunk& chunk : chunks)
        check(writer->add(chunk.name, std::span<const std::byte>(chunk.content)).has_value());
    check(writer->commit().has_value());
}

// Near its beginning, where the header is, or near its end, where the chunks are listed; or its end goes.
void damage_file(std::span<const uint8_t> by) {
    if (by.empty()) return;
    std::fstream file(path_of_asset(), std::ios::in | std::ios::out | std::ios::binary);
    std::string content(std::istreambuf_iterator<char>(file), {});
    const size_t part = std::min<size_t>(content.size(), 4096);
    const auto bytes = std::as_writable_bytes(std::span(content));
    fuzz::damage(by[0] % 2 == 0 ? bytes.first(part) : bytes.last(part), by.subspan(1));
    if (by[0] % 16 == 2) content.resize(content.size() - part * by.back() / 256);
    std::ofstream(path_of_asset(), std::ios::binary | std::ios::trunc) << content;
}

// What the arrays of a mesh that is played take, and its images.
size_t bytes_of(const ProgressiveMesh& pm) {
    size_t bytes = 0;
    const auto add = [&](const auto&... arrays) { bytes += (std::span(arrays).size_bytes() + ...); };
    add(pm.vertices, pm.further, pm.wedge_vertex, pm.ecols, pm.parents, pm.errors, pm.material_table);
    for (const FaceOrder& order : pm.orders)
        bytes += order.indices.size_bytes() + order.first_corner.size_bytes() + order.corners.size_bytes() +
                 order.permutation_bytes();
    for (const Image& image : pm.images) bytes += std::span(image.texels).size_bytes();
    return bytes;
}
size_t bytes_of(const DiscreteChain& chain) {
    size_t bytes = chain.vertices.size_bytes() + chain.further.size_bytes();
    for (const DiscreteLevel& level : chain.levels) bytes += level.indices.size_bytes();
    return bytes;
}
size_t bytes_of(const MaterialChunks& materials) {
    size_t bytes = std::span(materials.table).size_bytes();
    for (const Image& image : materials.images) bytes += std::span(image.texels).size_bytes();
    return bytes;
}

void use(const ProgressiveMesh& pm) {
    ProgressiveMesh counted = pm;
    fuzz::require_good(counted.count_levels(), "what an opened mesh plays is in range");
    const uint32_t last = pm.levels() - 1;
    fuzz::require(pm.level_for_error(pm.errors[last]) == last, "the last level has its error");
    fuzz::require(pm.level_for_triangles(pm.triangles_at(0)) == 0, "the first level has all triangles");
    fuzz::require(pm.level_for_wedges(pm.wedges_at(0)) == 0, "the first level has all wedges");
    for (const FaceOrder& order : pm.orders) {
        fuzz::require(pm.order_named(order.name) != nullptr, "an order is found by its name");
        fuzz::require(order.slots_at(last, pm.triangles_at(last)) >= pm.triangles_at(last), "faces are drawn");
    }
    if (!pm.validate()) return;
    for (uint32_t order = 0; order < pm.orders.size(); ++order) check(extract_level(pm, last / 2, order).has_value());
}

// Returns the bytes of the atlas and of its leaves as a mesh.
size_t use(const vgi::Atlas& atlas) {
    size_t bytes = fuzz::bytes_of(atlas);
    fuzz::require_good(extract_samples(atlas, atlas.levels() / 2).validate(), "a level is a valid mesh");
    if (atlas.leaves.empty()) return bytes;
    const TriMesh leaves = vgi::extract_leaves(atlas);
    fuzz::require_good(leaves.validate(), "leaves are a valid mesh");
    return bytes + fuzz::bytes_of(leaves);
}

// What backends make of a file of which a chunk has changed; all of them where its name is empty. Returns the bytes of
// what opens.
size_t use(const ChunkFile& file, const std::string& changed) {
    size_t bytes = 0;
    const auto concerns = [&](const char* part) {
        return changed.empty() || changed.starts_with(part) || changed.starts_with("mesh/");
    };
    if (concerns("lod/")) {
        if (const auto pm = ProgressiveMesh::open(file)) {
            use(*pm);
            bytes += bytes_of(*pm);
        }
    }
    if (concerns("discrete/")) {
        if (const auto chain = DiscreteChain::open(file, 1)) bytes += bytes_of(*chain);
    }
    if (const auto materials = read_materials(file)) {
        bytes += bytes_of(*materials);
        for (const Material& material : materials->table) {
            for (const Texture* texture : material.textures())
                fuzz::require(texture->image < static_cast<int64_t>(materials->images.size()), "an image is there");
        }
    }
    if (!concerns("vgi/")) return bytes;
    if (const auto atlas = vgi::open_atlas(file)) bytes += use(*atlas);
    return bytes;
}

// Opens the file. whole: it is not damaged itself. changed: the chunk that is.
void check_file(bool whole, const std::string& changed) {
    const fuzz::Watch watch;
    size_t bytes = std::filesystem::file_size(path_of_asset());
    if (const auto file = ChunkFile::open(path_of_asset())) {
        const auto verified = file->verify();
        fuzz::require(verified || !whole, "a file whose hashes are right is verified");
        bytes = std::max(bytes, use(*file, whole ? changed : std::string()));
    } else {
        fuzz::require(!whole, "a file whose hashes are right is opened");
    }
    watch.check(bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const TriMesh rock = generate(Shape::rock, 200, 1);
    static const std::array seeds = {chunks_of(with_fans(rock), 16, false), chunks_of(painted(rock), 16, true),
                                     chunks_of(rock, 2 * vgi::page_cells, true),
                                     chunks_of(rock, 2 * vgi::page_cells, false)};
    if (size < 2) return 0;
    // Those of several pages take longest, and are chosen least.
    const size_t small = seeds[0].size() + seeds[1].size();
    size_t seed = 0, chosen = data[0] < 224
                                  ? data[0] % small
                                  : small + (data[0] * 32u + data[1] / 8) % (seeds[2].size() + seeds[3].size());
    fuzz::require(small <= 224, "every chunk can be chosen");
    while (chosen >= seeds[seed].size()) chosen -= seeds[seed++].size();
    std::vector<Chunk> chunks = seeds[seed];
    const std::span<const uint8_t> rest(data + 2, size - 2);
    Chunk& chunk = chunks[chosen];
    if (data[1] % 8 == 7) {
        // The file is what is damaged.
    } else if (data[1] % 2 == 0) {
        const auto raw = std::as_bytes(rest);
        chunk.content.assign(raw.begin(), raw.end());
    } else {
        fuzz::damage(chunk.content, rest);
    }
    mend_sums(chunks, Chunk(chunk));
    write(chunks);
    const bool whole = data[1] % 8 != 7;
    if (!whole) damage_file(rest);
    check_file(whole, chunk.name);
    std::filesystem::remove(path_of_asset());
    return 0;
}
