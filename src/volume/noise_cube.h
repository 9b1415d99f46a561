// The cube map that displaces spheres: fractal noise on a sphere, as bytes.
//   Perlin, "Improving noise", SIGGRAPH 2002, for gradient noise.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace lodestone::volume {

// Noise by direction, 0 .. 1. Values stand at the corners of square cells, those of an edge in both faces that meet
// there, so nothing is seen of the edges.
struct NoiseCube {
    static constexpr uint32_t cells = 64;  // a side
    // Faces +x, -x, +y, -y, +z, -z; in each (cells + 1)^2 values, rows of the second coordinate. On a face of axis a
    // the coordinates are the direction's components a+1 and a+2 (cyclic), divided by the length of component a.
    std::vector<uint8_t> values;

    // Bilinear.
    // direction: any length > 0.
    float at(const glm::vec3& direction) const;
    // As shaders read it: a word a cell with its four corners, from the lowest byte on (0,0), (1,0), (0,1), (1,1);
    // cells row by row, face by face.
    std::vector<uint32_t> words() const;
};

NoiseCube make_noise_cube(uint64_t seed);

}  // namespace lodestone::volume
