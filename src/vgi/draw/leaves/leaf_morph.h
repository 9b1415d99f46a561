// How vertices of leaves come to their places: from the surface of samples, once the leaf appears, while the eye comes
// nearer. So it appears where the samples were that it is drawn instead of.
//
// A leaf comes to its place as a sample of its error and radius does. A vertex on a side is part of two leaves and has
// come as far as that which has come less far; so it is in one place in both, and has not set out when the second
// appears. Corners of squares, where more leaves meet, are in their places from the first.
//
// A vertex inside a square starts at the nearest point of the triangle that has its place in the chart where samples of
// smaller errors than the leaf's are left out: no cut has these where a leaf's vertices are as far away as its error
// allows. One on a side starts at the nearest point of such a side, by the smaller error of the two leaves.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "vgi/asset/leaves/leaves.h"

namespace lodestone::vgi {

struct LeafMorph {
    uint8_t border = 0;    // 1 + s: on side s of the square; else 0
    uint8_t exponent = 0;  // 0 .. 7
    // Where it starts, seen from its place: these times 4^exponent, units of the leaves' lattice. -63 .. 63.
    std::array<int8_t, 3> off{};

    uint32_t packed() const;  // as shaders have it (LODE_VGI_LEAVES)
    static LeafMorph unpacked(uint32_t word);
    glm::ivec3 start() const { return glm::ivec3(off[0], off[1], off[2]) * (1 << 2 * exponent); }
    bool operator==(const LeafMorph&) const = default;
};
// A sample as a leaf's vertices set out from it.
struct LeafSample {
    std::array<uint16_t, 3> position;  // lattice point
    uint8_t error;                     // code
};
// To within a thirtieth of its longest coordinate. start: as LeafMorph::start.
LeafMorph leaf_morph(const glm::dvec3& start, uint8_t border);

// The leaf of a square, then those across its sides: itself where there is none that may be drawn.
std::array<Leaf, 5> leaf_and_across(const Atlas& about, Atlas::Tile square);

// Of each vertex of a part of the leaf in a square. samples: of the square's page, row by row.
std::vector<LeafMorph> leaf_morphs(const Atlas& about, Atlas::Tile square, const LeafPart& part,
                                   std::span<const LeafSample> samples);

}  // namespace lodestone::vgi
