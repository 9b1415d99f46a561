// Writes 3D Tiles 1.1 (OGC 22-025r4): tileset.json, a glb per tile in t/, textures in i/, and where there are many
// tiles further tilesets in s/.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "tiles/cut_rims.h"
#include "tiles/placement.h"
#include "tiles/tile_glb.h"
#include "vgi/asset/atlas.h"

namespace lodestone::tiles {

// From so many tiles on, subtrees have tileset files of their own, so that a viewer need not read of all tiles first.
inline constexpr uint32_t external_from = 2000;

struct TilesetOptions {
    Encoding encoding = Encoding::meshopt;
    UpAxis up = UpAxis::y;
    uint32_t tile_triangles = 32768;    // of a tile, closing ones not counted; 128 .. 2^20
    uint32_t external = external_from;  // as external_from; small in tests
    glm::dmat4 transform{1};            // of the root, from tile axes
    std::string name;                   // of the source, for people
    CutRims cut;                        // of a piece; as fit() has them for the atlas
};

struct TilesetReport {
    uint32_t tiles = 0, leaves = 0, depth = 0, tilesets = 1;            // depth: of the tree, the root alone is 1
    uint64_t leaf_triangles = 0, triangles = 0, closing_triangles = 0;  // of leaves; of all tiles; of these, closing
    uint64_t glb_bytes = 0, json_bytes = 0, image_bytes = 0;
    uint64_t root_bytes = 0;     // of the root's glb
    double root_error = 0;       // metres
    double geometric_error = 0;  // of the whole tileset: the diagonal
    TileBox box;                 // around everything, before the root's transform
};

// Around the finest samples and leaves, with half a step of the lattice around: the report's box.
TileBox box_of(const vgi::Atlas& atlas, UpAxis up);

// Fills a folder that is there and empty. The bytes are the same for any number of threads. Fault::machine where the
// disk cannot take them; Fault::interrupted.
Result<TilesetReport> write_tileset(const vgi::Atlas& atlas, const std::filesystem::path& folder,
                                    const TilesetOptions& options, const Progress& progress);

// A tileset as part of another.
struct PlacedTileset {
    std::string uri;          // of its tileset.json, from the other's
    glm::dmat4 transform{1};  // in axes of tiles
    double geometric_error = 0;
    TileBox box;
};
// Around all of them. parts: at least one.
TileBox box_of(const std::vector<PlacedTileset>& parts);
// Writes a tileset.json of tilesets. transform: of the root. Returns its bytes.
Result<uint64_t> write_joint_tileset(const std::vector<PlacedTileset>& parts, const glm::dmat4& transform,
                                     const std::filesystem::path& folder);

}  // namespace lodestone::tiles
