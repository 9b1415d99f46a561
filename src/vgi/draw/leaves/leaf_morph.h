// How vertices of leaves come to their places: from the surface of samples, while the eye comes nearer, so that a leaf
// appears where the samples were that it is drawn instead of.
//
// A vertex has an error, the least of the leaves that it is part of, and moves as a sample of that error does: it sets
// out where the error is as large as is allowed. There the cut has no samples of smaller errors. So a vertex inside a
// square starts at the nearest point of the triangle that has its place in the chart where those are left out, one on
// a side at the nearest point of such a side, one in a corner at the sample there. What leaves share is in one place in
// all of them, bit for bit, and has not set out when the last of them appears.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "vgi/asset/leaf_demands.h"
#include "vgi/asset/leaves.h"

namespace lodestone::vgi {

struct LeafMorph {
    uint8_t error = 0;     // code (error_codes.h)
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
LeafMorph leaf_morph(const glm::dvec3& start, uint8_t error);

// Of each vertex of a part of the leaf in a square. samples: of the square's page, row by row.
std::vector<LeafMorph> leaf_morphs(const Atlas& about, const LeafNeighbours& neighbours, Atlas::Tile square,
                                   const LeafPart& part, std::span<const LeafSample> samples);

}  // namespace lodestone::vgi
