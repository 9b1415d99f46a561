#version 460
#extension GL_GOOGLE_include_directive : require
// Reads a pool that may be split, sums it, and writes an indirect draw of as many vertices as the first word says.
#include "shared/draw_constants.h"
#include "shared/texels.glsl"

layout(local_size_x = 64) in;
LODE_POOL(0, numbers, uint, 1)
layout(set = 1, binding = 1, std430) buffer Sums { uint sums[]; };
layout(set = 1, binding = 2, std430) writeonly buffer Arguments { uint arguments[]; };

void main() {
    uint count = draw_constants.words[0];
    if (gl_GlobalInvocationID.x < count) atomicAdd(sums[0], numbers_at(gl_GlobalInvocationID.x));
    if (gl_GlobalInvocationID.x == 0) {
        arguments[0] = draw_constants.words[1];  // vertices
        arguments[1] = 1;
        arguments[2] = 0;
        arguments[3] = 0;
        sums[1] = numbers_at(count - 1);
    }
}
