// Gradient noise and its fractal sums, the same on every machine.
// Perlin, "Improving noise", SIGGRAPH 2002; Musgrave, in "Texturing and Modeling: A Procedural Approach", 3rd ed. 2003
// (ridged multifractals).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

namespace lodestone {

// Smooth noise of about -1 .. 1 with features of size about 1.
double gradient_noise(const glm::dvec3& p, uint64_t seed);

// Sum of octaves, each of `gain` times the amplitude and `lacunarity` times the frequency of the one before; octaves
// whose features would be smaller than smallest_feature are left out. About -1 .. 1.
double fractal_noise(const glm::dvec3& p, uint64_t seed, double gain, double smallest_feature);

// Ridged multifractal: sharp crests, detail where it is high. 0 .. about 1.
double ridged_noise(const glm::dvec3& p, uint64_t seed, double gain, double smallest_feature);

}  // namespace lodestone
