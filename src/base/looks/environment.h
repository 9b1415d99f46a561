// Light that comes from far away from all around, as renderers take it. light/prefilter.h makes it of a sky or a
// picture of surroundings.
//
//   Karis, "Real shading in Unreal Engine 4", SIGGRAPH 2013 course (what is mirrored, and shares of it)
//   Ramamoorthi, Hanrahan, "An efficient representation for irradiance environment maps", SIGGRAPH 2001 (matte)
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec4.hpp>
#include <vector>

namespace lodestone {

// Radiance is linear; texels are four half floats, the first in the lowest bits (glm::packHalf4x16).
struct Environment {
    // A cube. Its faces look towards +x, -x, +y, -y, +z and -z, as Vulkan lays out cubes.
    uint32_t side = 0;  // texels along a face of level 0, a power of two
    // Level k of n: what a surface of roughness (k / (n - 1))^1.5 mirrors, seen straight on; level 0 is what is seen.
    // Face after face, rows top to bottom, of side >> k texels.
    std::vector<std::vector<uint64_t>> levels;
    // The mean radiance that a matte surface with normal (x, y, z) sees, weighted by cosines, is the sum of these times
    // 1, y, z, x, xy, yz, 3z^2 - 1, xz and x^2 - y^2. Their fourth components are 0.
    std::array<glm::vec4, 9> matte{};
    // What a surface sends to the eye, in shares of what it mirrors and sees: across by the cosine between normal and
    // eye, down by roughness, both from 0 to 1. The specular colour times the first, and the second, of what is
    // mirrored. The third: what Fresnel's term takes from matte surfaces, beside the specular colour. The fourth: where
    // most of what is mirrored comes from, from the normal (0) to where a smooth surface would mirror from (1).
    uint32_t shares_across = 0, shares_down = 0;  // texels, 2 and more
    std::vector<uint64_t> shares;                 // rows top to bottom
};

}  // namespace lodestone
