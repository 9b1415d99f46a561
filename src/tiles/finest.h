// The finest surface of an atlas, as tiles show it: the source's triangles where the atlas has leaves
// (vgi/asset/leaves/leaves.h), the finest samples elsewhere. Leaf tiles show it, errors are distances to it, and the
// borders of all tiles end in it.
//
// Places are points of one lattice, on which samples and vertices of leaves lie: that of leaves where there are any,
// else that of samples.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/leaves/leaf_triangles.h"

namespace lodestone::tiles {

using LatticePoint =
    std::array<uint32_t, 3>;  // at most 21 bits each, so floats hold them exactly, also in steps of samples

// log2 of the steps of places to one of the atlas's lattice.
inline uint32_t place_shift(const vgi::Atlas& atlas) { return atlas.leaves.empty() ? 0 : atlas.leaf_shift; }
// A place in steps of the atlas's lattice.
inline glm::dvec3 in_steps(const vgi::Atlas& atlas, const LatticePoint& place) {
    return glm::dvec3(place[0], place[1], place[2]) / static_cast<double>(1u << place_shift(atlas));
}

// A square of a chart, counted in cells of its own finest samples.
struct ChartSquare {
    uint32_t chart = 0, x = 0, y = 0;  // x, y: of its lowest corner, multiples of `cells`
    uint32_t cells = 0;                // along a side, a power of two
    auto operator<=>(const ChartSquare&) const = default;
};

// How far along the side of its chart, counter-clockwise, the side of a square begins; steps of finest samples.
inline uint32_t first_step(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side) {
    const uint32_t along = side % 2 == 0 ? square.x : square.y;
    return side < 2 ? along : atlas.cells_of(square.chart) - along - square.cells;
}
// The sample `step`, 0 .. square.cells, along a side of a square, counter-clockwise.
inline std::array<uint32_t, 2> sample_on_side(const ChartSquare& square, uint32_t side, uint32_t step) {
    const auto [x, y] = vgi::on_side(side, step, square.cells);
    return {square.x + x, square.y + y};
}

// A sample or a vertex of a leaf; what the atlas has not is 0.
struct TileVertex {
    LatticePoint position{};
    std::array<uint16_t, 2> uv{};    // as Atlas::uvs
    std::array<int8_t, 2> normal{};  // octahedral, as Atlas::normals
    glm::u8vec4 colour{0};           // sRGB and alpha
    bool operator==(const TileVertex&) const = default;
};

// The material at a sample; 0 where the atlas has one.
uint16_t material_at(const vgi::Atlas& atlas, uint32_t chart, uint32_t x, uint32_t y);
// A sample.
TileVertex sample_at(const vgi::Atlas& atlas, uint32_t chart, uint32_t x, uint32_t y);

// A vertex on the side of a square.
struct SideVertex {
    TileVertex vertex;
    double along = 0;  // from where the side begins, in finest cells; whole for samples
};

// Every `stride`-th sample along a side of a square, counter-clockwise.
std::vector<SideVertex> samples_of_side(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side,
                                        uint32_t stride);

// The finest triangles of a square.
struct FinestTriangles {
    std::vector<TileVertex> vertices;
    std::vector<glm::dvec2> at;                      // per vertex: its place in the chart, in finest cells
    std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside; none has two equal places
    std::vector<uint16_t> materials;                 // per triangle; 0 where the atlas has one
};

// Whether the source's triangles are shown in some part of a square. One that has them can be shown at its finest only
// if it is made of whole squares of leaves.
bool has_leaves(const vgi::Atlas& atlas, const ChartSquare& square);
// Along a side of the squares of leaves of a chart; finest cells.
inline uint32_t leaf_cells(const vgi::Atlas& atlas, uint32_t chart) {
    return atlas.cells_of(chart) / atlas.leaves_per_side(chart);
}
// How many finest triangles a square has, as they are stored.
uint64_t finest_triangles_in(const vgi::Atlas& atlas, const ChartSquare& square);

// What is known of all leaves together: beside what each is, and how their sides run.
class FinestSurface {
public:
    FinestSurface() = default;  // of no atlas
    explicit FinestSurface(const vgi::Atlas& atlas);

    // atlas: that of the constructor, here and below. square: can be shown at its finest.
    FinestTriangles triangles(const vgi::Atlas& atlas, const ChartSquare& square) const;
    // The finest line along a side, counter-clockwise: the same as that of the square across, run through the other
    // way. Its ends are on the corners of the square; `along` never falls.
    std::vector<SideVertex> side(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side) const;

private:
    void add_side(const vgi::Atlas& atlas, const vgi::Atlas::Tile& leaf_square, uint32_t side, uint32_t before,
                  std::vector<SideVertex>& line) const;

    vgi::LeafBorders borders_;
    // Of sides of leaves beside leaves, 4 leaf + side: where the line of each begins, and the end of all. None of
    // others.
    std::vector<uint32_t> first_;
    std::vector<SideVertex> lines_;
};

}  // namespace lodestone::tiles
