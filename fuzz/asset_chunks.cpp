// The opener of assets, with every hash right: the first byte chooses a chunk of a small sound asset, the rest replaces
// its content. What opens is checked, extracted and decoded.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <map>

#include "apps/scene/asset.h"
#include "apps/scene/bake.h"
#include "lod/asset/cursor.h"
#include "mesh/generate.h"
#include "mesh/repair.h"

using namespace lodestone;

namespace {

struct Seed {
    std::filesystem::path path = "/dev/shm/lodestone-fuzz-" + std::to_string(getpid()) + ".lode";
    std::vector<std::pair<std::string, std::vector<std::byte>>> chunks;

    Seed() {
        BakeOptions options;
        options.backends = {"lod", "discrete", "vgi"};
        options.orders = {"keyframe", "greedy", "classic"};
        options.atlas.clusters.clusters = 2;
        options.atlas.cells = 64;
        options.error_samples = 1000;
        BakeInput input;
        input.mesh = generate(Shape::rock, 200, 1);
        if (!repair(input.mesh)) std::abort();
        input.name = "rock";
        if (!bake_asset(std::move(input), options, path, {})) std::abort();
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
        for (size_t i = 0; i < seed.chunks.size(); ++i) {
            const auto content = i == chosen ? std::as_bytes(std::span(data + 1, size - 1))
                                             : std::span<const std::byte>(seed.chunks[i].second);
            if (!writer->add(seed.chunks[i].first, content)) std::abort();
        }
        if (!writer->commit()) std::abort();
    }
    const auto asset = open_asset(seed.path);
    if (!asset) return 0;
    if (asset->lod != nullptr && asset->lod->validate()) {
        for (uint32_t order = 0; order < asset->lod->orders.size(); ++order) {
            if (!extract_level(*asset->lod, asset->lod->levels() / 2, order)) std::abort();
        }
    }
    if (asset->atlas_file != nullptr) {
        const auto atlas = asset->atlas();
        if (atlas) atlas->extract(atlas->levels() / 2);
    }
    return 0;
}
