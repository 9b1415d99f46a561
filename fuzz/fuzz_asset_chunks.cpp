// The openers of assets, with every hash and checksum right: the first byte chooses a chunk of a small sound asset, the
// rest replaces its content. What opens is played, extracted and decoded.
#include <unistd.h>

#include <filesystem>

#include "baseline/discrete.h"
#include "fuzz/promise.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "tests/fixtures/block_sums.h"
#include "vgi/asset/atlas_chunks.h"
#include "vgi/bake/bake.h"

using namespace lodestone;

namespace {

void check(bool good) { fuzz::require(good, "a sound asset is made, written and opened"); }

struct Seed {
    std::filesystem::path path = "/dev/shm/lodestone-fuzz-" + std::to_string(getpid()) + ".lode";
    std::vector<std::pair<std::string, std::vector<std::byte>>> chunks;

    Seed() {
        TriMesh mesh = generate(Shape::rock, 200, 1);
        check(repair(mesh).has_value());
        auto list = make_quadric_simplifier()->simplify(mesh, {});
        check(list.has_value());
        auto pm = bake_progressive_mesh(mesh, *list, {"keyframe", "greedy", "classic"});
        check(pm.has_value());
        vgi::AtlasOptions options;
        options.clusters.clusters = 2;
        options.cells = 64;
        options.error_samples = 500;
        vgi::AtlasReport report;
        const auto atlas = vgi::make_atlas(mesh, options, report);
        const auto chain = make_discrete_chain(mesh);
        check(atlas && chain);
        {
            auto writer = ChunkWriter::create(path, {});
            check(pm->write_chunks(*writer) && vgi::write_chunks(*atlas, *writer) && chain->write_chunks(*writer));
            check(writer->commit().has_value());
        }
        const auto file = ChunkFile::open(path);
        for (const ChunkInfo& info : file->chunks()) {
            const auto bytes = *file->bytes(info.name);
            chunks.emplace_back(info.name, std::vector(bytes.begin(), bytes.end()));
        }
    }
    ~Seed() { std::filesystem::remove(path); }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Seed seed;
    if (size < 1) return 0;
    const size_t chosen = data[0] % seed.chunks.size();
    {
        auto writer = ChunkWriter::create(seed.path, {});
        const auto given = std::as_bytes(std::span(data + 1, size - 1));
        for (size_t i = 0; i < seed.chunks.size(); ++i) {
            std::span<const std::byte> content = i == chosen ? given : seed.chunks[i].second;
            std::vector<StoredBlock> table;
            if (seed.chunks[i].first == "lod/table" && seed.chunks[chosen].first == "lod/blocks") {
                table = fixtures::with_right_sums(seed.chunks[i].second, given);
                content = std::as_bytes(std::span(table));
            }
            check(writer->add(seed.chunks[i].first, content).has_value());
        }
        check(writer->commit().has_value());
    }
    const auto file = ChunkFile::open(seed.path);
    check(file.has_value());
    if (const auto pm = ProgressiveMesh::open(*file); pm && pm->validate()) {
        for (uint32_t order = 0; order < pm->orders.size(); ++order)
            check(extract_level(*pm, pm->levels() / 2, order).has_value());
    }
    DiscreteChain::open(*file, 1);
    if (const auto atlas = vgi::open_atlas(*file)) atlas->extract(atlas->levels() / 2);
    return 0;
}
