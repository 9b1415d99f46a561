// How far each tile is from the finest samples that it stands for, and the box around these.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "tiles/tile_tree.h"

namespace lodestone::tiles {

// A box in steps of the atlas's lattice.
struct LatticeBox {
    std::array<uint16_t, 3> low{65535, 65535, 65535}, high{0, 0, 0};
    void add(const std::array<uint16_t, 3>& point);
    void add(const LatticeBox& box);
};

struct TileMeasure {
    // Object units: no point of the tile, of what closes its borders included, is farther from the surface of the
    // finest samples, and no point of that farther from the tile. Each square is measured against its own samples, to
    // 2% (farthest.h): where those of a neighbour are nearer, this is more than what is. 0 of a leaf, and above that of
    // every child.
    double error = 0;
    double source_error = 0;  // object units; two-sided distance to the source, as measured by the bake
    LatticeBox box;           // around the finest samples of the tile, and so around all tiles below it
};

// Per tile. Tiles without error need nothing below them: their children are taken out of the tree.
// Fault::interrupted where the progress says stop.
Result<std::vector<TileMeasure>> measure_tiles(const vgi::Atlas& atlas, TileTree& tree, const Progress& progress);

}  // namespace lodestone::tiles
