// An Environment of radiance told by direction. base/looks/environment.h says what it is; the light that lobes see is
// sampled from coarser levels where samples are far apart.
//
// A lobe is weighted as one seen straight on is, shadowing included.
//
//   Krivanek, Colbert, "Real-time shading with filtered importance sampling", EGSR 2008
#pragma once

#include <functional>
#include <glm/vec3.hpp>

#include "base/looks/environment.h"

namespace lodestone {

// What comes from a direction of unit length, linear, 0 and more. Called by several threads.
using Radiance = std::function<glm::vec3(const glm::vec3& direction)>;

inline constexpr uint32_t environment_side = 512;  // texels along a face: six to a degree

// points: along a side of a texel of level 0, where radiance is asked for its mean. side: of level 0, a power of two,
// 128 and more. What is brighter than half floats hold is cut. The same for any number of threads.
Environment make_environment(const Radiance& radiance, uint32_t points = 2, uint32_t side = environment_side);

}  // namespace lodestone
