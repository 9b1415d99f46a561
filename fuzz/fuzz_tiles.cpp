// Tilesets as strangers write them: a small sound one of which one file is replaced or damaged. The first byte chooses
// the file, the second the tileset, mostly that of a single file, and what happens to it: the rest is its content, or
// damages it, or its text. What is read is told of and checked, random cuts included.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "fuzz/mutators.h"
#include "fuzz/promise.h"
#include "fuzz/watch.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "tiles/check/check.h"
#include "tiles/check/tile_content.h"
#include "tiles/tileset.h"
#include "vgi/bake/bake.h"

using namespace lodestone;
using namespace lodestone::fuzz;

namespace {

namespace fs = std::filesystem;

// Of a file, and of the triangles that it holds if it is a tile.
size_t bytes_of(const fs::path& path) {
    size_t bytes = fs::file_size(path);
    if (path.extension() != ".glb") return bytes;
    if (const auto content = tiles::read_tile_content(path))
        bytes += content->positions.size() * sizeof content->positions[0] +
                 content->triangles.size() * sizeof content->triangles[0];
    return bytes;
}

struct TilesetFiles {
    fs::path folder;
    size_t bytes = 0;  // of all files
    std::vector<std::pair<fs::path, std::string>> files;

    // Of so many clusters with charts of so many cells, in tiles of so many triangles; from so many tiles on in several
    // files.
    TilesetFiles(const char* name, uint32_t clusters, uint32_t cells, uint32_t triangles, uint32_t external)
        : folder(std::string("/dev/shm/lodestone-fuzz-tiles-") + name + std::to_string(getpid())) {
        TriMesh mesh = generate(Shape::rock, 100, 1);
        require_good(repair(mesh), "a rock is repaired");
        vgi::AtlasOptions options;
        options.clusters.clusters = clusters;
        options.cells = cells;
        options.error_samples = 500;
        vgi::AtlasReport report;
        const auto atlas = vgi::make_atlas(mesh, options, report);
        require_good(atlas, "a rock is baked");
        tiles::TilesetOptions tile_options;
        tile_options.tile_triangles = triangles;
        tile_options.external = external;
        fs::remove_all(folder);
        fs::create_directories(folder);
        require_good(tiles::write_tileset(*atlas, folder, tile_options, {}), "tiles are written");
        const auto facts = tiles::tileset_facts(folder);
        require_good(facts, "and read");
        require((facts->files > 1) == (facts->tiles >= external), "large ones are several files");
        for (const auto& entry : fs::recursive_directory_iterator(folder)) {
            if (!entry.is_regular_file()) continue;
            std::ifstream in(entry.path(), std::ios::binary);
            files.emplace_back(entry.path(), std::string(std::istreambuf_iterator<char>(in), {}));
        }
        std::ranges::sort(files);
        for (const auto& [path, content] : files) bytes += bytes_of(path);
    }
    ~TilesetFiles() { fs::remove_all(folder); }
};

void put(const fs::path& path, const std::string& content) { std::ofstream(path, std::ios::binary) << content; }

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const TilesetFiles small("small-", 1, 8, 128, 1000), large("large-", 2, 16, 256, 20);
    if (size < 3) return 0;
    const TilesetFiles& tileset = data[1] / 16 == 15 ? large : small;
    const auto& [path, sound] = tileset.files[data[0] % tileset.files.size()];
    const std::span<const uint8_t> rest(data + 2, size - 2);
    std::string content = sound;
    if (data[1] % 4 == 0) {
        content.assign(rest.begin(), rest.end());
    } else if (data[1] % 4 == 1) {
        damage(std::as_writable_bytes(std::span(content)), rest);
    } else {
        // Some text in place of other text: JSON stays JSON more often.
        const size_t at = (rest[0] * 256u + data[1]) % content.size();
        content.replace(at, data[1] / 4 % 16, std::string(rest.begin() + 1, rest.end()));
    }
    put(path, content);
    const Watch watch;
    // What is told of is read as what is checked is, so that one of them will mostly do.
    if (size % 4 == 0) {
        if (const auto facts = tiles::tileset_facts(tileset.folder); !facts) check_error(facts.error());
    }
    tiles::CheckOptions options;
    options.cuts = 2;
    if (const auto checked = tiles::check_tileset(tileset.folder, options, {}); !checked) check_error(checked.error());
    watch.check(tileset.bytes + bytes_of(path));
    put(path, sound);
    return 0;
}
