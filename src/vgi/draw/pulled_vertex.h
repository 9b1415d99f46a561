// What shaders/vgi/sample.vert makes of an index, done on the CPU from the same buffers: for measurements and tests.
#pragma once

#include "frame/plan_mirror.h"

namespace lodestone::vgi {

// Object space, moved towards its place as drawn.
glm::vec3 pulled_vertex(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance,
                        uint32_t index);

}  // namespace lodestone::vgi
