// Which part of an atlas each tile shows, and how finely: a tree whose root shows all charts coarsely, whose children
// show groups of charts that lie together, then single charts, then quarters of charts.
//
// The children of a tile cover what it covers, once, at a finer level; a leaf shows the finest surface (finest.h): the
// source's triangles where the atlas has leaves, which then stand for the finest samples. So any set of tiles that
// holds one tile of every way from the root to a leaf covers the surface once: a cut.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "tiles/cut_rims.h"
#include "tiles/finest.h"
#include "vgi/asset/atlas.h"

// Atlases as 3D Tiles.
namespace lodestone::tiles {

// A side of a square of a tile that other tiles can meet, or where the surface ends.
struct ClosingSide {
    uint32_t square = 0;  // into TileNode::squares
    uint32_t side = 0;    // 0 .. 3, as those of charts
};

inline constexpr uint32_t no_tile = ~0u;

// A tile before it has triangles.
struct TileNode {
    uint32_t level = 0;                // of the atlas
    uint32_t parent = no_tile;         // of the root no_tile
    std::vector<uint32_t> children;    // none of a leaf
    std::vector<ChartSquare> squares;  // sorted; all of one level
};

// Tiles, each before those below it, and these behind it without a gap.
struct TileTree {
    std::vector<TileNode> nodes;  // the root first
    FinestSurface finest;         // of the atlas
    CutRims cut;                  // of a piece of its source
    // Tiles of the subtree that begins at each, itself included.
    std::vector<uint32_t> subtree_sizes() const;
    // Leaves show the finest surface; children cover what their parent does, once, at a finer level, or finest.
    // Fault::invariant names the tile.
    Result<void> validate(const vgi::Atlas& atlas) const;
};

// Between samples of a level, in a chart's own finest cells.
inline uint32_t stride_of(const vgi::Atlas& atlas, uint32_t chart, uint32_t level) {
    return 1u << atlas.own_level(chart, level);
}
// Triangles of a square at a level, without those that close borders.
uint64_t triangles_of(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t level);

inline constexpr uint32_t least_tile_triangles = 128, most_tile_triangles = 1u << 20;

// most_triangles: of a tile, least_tile_triangles .. most_tile_triangles; the root has more where the atlas's coarsest
// level has, and a leaf where a single square of leaves has.
TileTree make_tile_tree(const vgi::Atlas& atlas, uint32_t most_triangles);

// Sides across which lies no square of the tile: one of another tile of the same level, or nothing.
std::vector<ClosingSide> closing_sides(const vgi::Atlas& atlas, const TileTree& tree, uint32_t tile);

}  // namespace lodestone::tiles
