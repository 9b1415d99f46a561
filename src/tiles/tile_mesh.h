// The triangles of a tile: those of its samples, and behind them those that close its borders.
//
// Where other tiles can be beside it, a tile goes on from its own border to that of the finest samples, by triangles
// that use samples of the border alone: from an edge (a, b) of a level to the two edges of the next finer one, by way
// of the sample m between, the triangle (a, m, b). Its own triangle has a -> b, that one has b -> a, a -> m and m -> b.
// What remains of all of them is the border of the finest samples, whatever the tile's level. The tile beside it ends
// in the same line, run through the other way. So the edges of every cut cancel, with no look at which tile is beside
// which, and they do so while tiles are loading. Such triangles lie between the border of the tile and that of the
// finest samples, so they stand out no farther than the tile's own error, and leaves have none.
//
// Where the surface ends nothing is closed, but where two rims of the finest samples are one line (meeting_rims.h), and
// where a piece was cut from its source (cut_rims.h): there triangles lead on from the finest samples, of leaves, too.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tiles/tile_tree.h"

namespace lodestone::tiles {

// A sample as a vertex; what the atlas has not is 0.
struct TileVertex {
    std::array<uint16_t, 3> position{};  // lattice point of the atlas
    std::array<uint16_t, 2> uv{};        // as Atlas::uvs
    std::array<int8_t, 2> normal{};      // octahedral, as Atlas::normals
    glm::u8vec4 colour{0};               // sRGB and alpha
    bool operator==(const TileVertex&) const = default;
};

struct TileMesh {
    std::vector<TileVertex> vertices;
    std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside; none has two equal places
    std::vector<uint16_t> materials;                 // per triangle; empty where the atlas has one material
    size_t surface_triangles = 0;                    // the first ones; the others close borders
};

// The triangles of a tile. Leaves are the finest samples.
TileMesh make_tile_mesh(const vgi::Atlas& atlas, const TileTree& tree, uint32_t tile);

// The samples of a border side that its closing triangles use: visit(a, m, b), steps along the side (sample_on_side),
// for every triangle, from the tile's own stride down to 2. stride: of the tile's samples; cells: of the side.
template <class Visit>
void for_closing_triangles(uint32_t stride, uint32_t cells, Visit&& visit) {
    for (uint32_t edge = stride; edge > 1; edge /= 2) {
        for (uint32_t a = 0; a < cells; a += edge) visit(a, a + edge / 2, a + edge);
    }
}

}  // namespace lodestone::tiles
