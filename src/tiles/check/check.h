// Checks tilesets: what viewers and their users rely on.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/result.h"

namespace lodestone::tiles {

struct CheckOptions {
    uint32_t cuts = 100;   // random sets of tiles that cover the surface, of each part
    uint64_t seed = 1;     // of these
    bool measure = false;  // errors of tiles are measured anew; takes long
};

struct CheckedPoint {
    std::string name;  // what is checked
    bool passed = true;
    std::string message;  // of the first place where it is not so
};

struct TilesetFacts {
    std::string generator;
    uint32_t files = 0, tiles = 0, leaves = 0, parts = 0, depth = 0;
    uint64_t json_bytes = 0, tile_bytes = 0, triangles = 0, leaf_triangles = 0, closing_triangles = 0;
    double geometric_error = 0, root_error = 0;  // of the whole; of the first tile
    bool placed = false;                         // the root has a transform
    // Of tiles of each depth, the root's first.
    struct Depth {
        uint32_t tiles = 0;
        uint64_t bytes = 0, triangles = 0;
        double largest_error = 0;
    };
    std::vector<Depth> depths;
};

// What a tileset holds. Fault::format where it cannot be read (tileset_reader.h, tile_content.h).
Result<TilesetFacts> tileset_facts(const std::filesystem::path& path);

struct TilesetCheck {
    std::vector<CheckedPoint> points;
    uint64_t cuts = 0, unmatched_edges = 0, rim_edges = 0, repeated_edges = 0;
    uint32_t largest_step = 0;  // levels between tiles of one cut, at most
    // Said over measured errors, smallest and largest, over tiles; 0 where not measured.
    double least_ratio = 0, largest_ratio = 0;
    bool passed() const;
};

// Structure, errors that fall, volumes that hold what is below them, contents, one lattice for all, and whether random
// cuts are closed. Fault::format where it cannot be read at all.
Result<TilesetCheck> check_tileset(const std::filesystem::path& path, const CheckOptions& options,
                                   const Progress& progress);

}  // namespace lodestone::tiles
