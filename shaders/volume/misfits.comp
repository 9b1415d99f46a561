#version 460
#extension GL_GOOGLE_include_directive : require
// Marches the rays of pixels that no tap of the smaller target fits. In which order they are listed does not matter:
// each pixel is one thread's own.
#include "volume/debug.glsl"
#include "volume/march.glsl"

layout(local_size_x = LODE_MISFITS_GROUP) in;

layout(set = 1, binding = LODE_VOLUME_MISFITS, std430) readonly buffer MisfitBlock { uint misfits[]; };
layout(set = 1, binding = LODE_VOLUME_RESULT, std430) writeonly buffer ResultBlock { uvec2 result[]; };

void main() {
    if (gl_GlobalInvocationID.x >= misfits[3]) return;
    uint number = misfits[LODE_MISFITS_HEAD + gl_GlobalInvocationID.x];
    ivec2 pixel = ivec2(number % volume.picture.x, number / volume.picture.x);
    ViewRay ray = ray_of(pixel);
    Marched m = march(ray);
    if (frame.debug_view >= LODE_DEBUG_VOLUME_BRICKS) m = shown_as(m, ray);
    result[number] = packed_result(m);
}
