// Texture coordinates as whole numbers: multiples of 2^-24, which floats hold exactly, and so do one minus them. What
// is turned over or overlaps is told exactly.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "vgi/unwrap/flat_chart.h"
#include "vgi/unwrap/packing.h"

namespace lodestone::vgi {

inline constexpr int64_t lattice_side = int64_t{1} << 24;  // of a square
using LatticePoint = glm::i64vec2;                         // 0 .. lattice_side; y upwards

// Twice the area of a triangle, > 0 where it is counter-clockwise. Exact.
inline int64_t twice_area(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

// A chart where it was packed: a point per vertex of its patch. Rounding may turn small triangles over; vertices inside
// then move a little until none is. left: how many could not be mended.
std::vector<LatticePoint> onto_lattice(const FlatChart& chart, const PackedRectangle& place, uint32_t& left);

// A triangle in one of the squares.
struct LatticeTriangle {
    uint32_t square = 0;
    LatticePoint corners[3];
};
// Triangles without positive area, and pairs that have a part of a square in common.
struct LatticeFaults {
    uint64_t flipped = 0, overlapping = 0;
};
LatticeFaults faults_of(std::span<const LatticeTriangle> triangles, uint32_t squares);

}  // namespace lodestone::vgi
