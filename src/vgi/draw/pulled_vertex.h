// What shaders/vgi/sample.vert makes of an index, done on the CPU from the same buffers: for measurements, tests, and
// renderers that take vertices from the CPU.
#pragma once

#include <glm/gtc/type_precision.hpp>
#include <glm/vec2.hpp>

#include "frame/plan_mirror.h"

namespace lodestone::vgi {

// Object space, moved towards its place as drawn.
glm::vec3 pulled_vertex(const PlanMirror& mirror, const Draw& draw, const FrameInput& input, uint32_t instance,
                        uint32_t index);

// What a vertex looks like.
struct PulledAttributes {
    glm::vec3 normal{0, 0, 1};  // object space, unit length
    glm::vec2 uv{0};            // texture coordinates; 0 where the asset has none
    glm::u8vec4 colour{255};    // sRGB and alpha; white where the asset has none
    uint32_t material = 0;      // of the asset
};
// As shaders/vgi/atlas.frag has them at the place of the vertex, of the level that the vertex is of; of a coarser one
// where that is not there. Of a corner that stands for many charts: a normal of what lies around it, and what else one
// of the charts has there.
PulledAttributes pulled_attributes(const PlanMirror& mirror, const Draw& draw, const FrameInput& input,
                                   uint32_t instance, uint32_t index);

}  // namespace lodestone::vgi
