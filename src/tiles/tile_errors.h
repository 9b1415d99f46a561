// How far each tile is from the finest surface (finest.h) that it stands for, and the box around these.
#pragma once

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "tiles/tile_tree.h"

namespace lodestone::tiles {

// A box around places.
struct LatticeBox {
    LatticePoint low{~0u, ~0u, ~0u}, high{0, 0, 0};
    void add(const LatticePoint& point);
    void add(const LatticeBox& box);
};

// Around the finest samples and leaves of all charts: that of the root.
LatticeBox finest_box(const vgi::Atlas& atlas);

struct TileMeasure {
    // Object units: no point of the tile, of what closes its borders included, is farther from the finest
    // surface, and no point of that farther from the tile. Each square is measured against its own part of it, to 2%
    // (errors/farthest.h): where that of a neighbour is nearer, this is more than what is. 0 of a leaf, and above that
    // of every child.
    double error = 0;
    double source_error = 0;  // object units; two-sided distance to the source, as measured by the bake
    LatticeBox box;           // around the finest samples and leaves of the tile, so around all tiles below it
};

// Per tile. Tiles without error need nothing below them: their children are taken out of the tree.
// Fault::interrupted where the progress says stop.
Result<std::vector<TileMeasure>> measure_tiles(const vgi::Atlas& atlas, TileTree& tree, const Progress& progress);

}  // namespace lodestone::tiles
