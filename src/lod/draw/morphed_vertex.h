// What shaders/lod/morph_vert.glsl makes of an index, done on the CPU from the same buffers: for measurements and
// tests.
#pragma once

#include "frame/plan_mirror.h"

namespace lodestone {

// Object space.
glm::vec3 morphed_vertex(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance,
                         uint32_t index);

}  // namespace lodestone
