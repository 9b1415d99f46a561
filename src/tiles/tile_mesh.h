// The triangles of a tile: those of its surface, and behind them those that close its borders.
//
// A tile goes on from its own border to the line of the finest surface (finest.h), by triangles that use vertices of
// the border alone: strips from the line of a level to that of the next finer one. From an edge (a, b) to its two
// halves, by way of the sample m between, such a strip is the triangle (a, m, b). The tile's own triangle has a -> b,
// that one has b -> a, a -> m and m -> b. What remains of all of them is the finest line, whatever the tile's level:
// that of the source's triangles where there are leaves on both sides, that of the finest samples elsewhere. The tile
// beside it ends in the same line, run through the other way. So the edges of every cut cancel, with no look at which
// tile is beside which, and they do so while tiles are loading. Where the surface ends the same is done, so what is
// left over of any cut is the rim of the finest surface. Such triangles lie between lines of levels, so they stand out
// no farther than the tile's own error, and leaves have none.
//
// Where a piece was cut from its source (cut_rims.h) triangles lead on from the finest line, of leaves, too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tiles/tile_tree.h"

namespace lodestone::tiles {

struct TileMesh {
    std::vector<TileVertex> vertices;
    std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside; none has two equal places
    std::vector<uint16_t> materials;                 // per triangle; empty where the atlas has one material
    size_t surface_triangles = 0;                    // the first ones; the others close borders
};

// The triangles of a tile.
TileMesh make_tile_mesh(const vgi::Atlas& atlas, const TileTree& tree, uint32_t tile);

// A triangle of what closes a side, counter-clockwise; it may have equal places.
struct ClosingTriangle {
    std::array<SideVertex, 3> corners;  // the first is a sample
};
// What closes a side of a square whose samples are `stride` finest ones apart: none where that is 1.
std::vector<ClosingTriangle> closing_triangles(const vgi::Atlas& atlas, const FinestSurface& finest,
                                               const ChartSquare& square, uint32_t side, uint32_t stride);

}  // namespace lodestone::tiles
