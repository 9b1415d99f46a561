#version 460
#extension GL_GOOGLE_include_directive : require
// Marches a ray for every pixel of the target. Where the target is smaller than the picture, each of its pixels is one of
// the picture's, and upsample.comp puts them back.
#include "volume/debug.glsl"
#include "volume/march.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = LODE_VOLUME_TAPS, std430) writeonly buffer TapBlock { uvec4 taps[]; };
layout(set = 1, binding = LODE_VOLUME_RESULT, std430) writeonly buffer ResultBlock { uvec2 result[]; };

// The picture's pixel that a pixel of the target is.
ivec2 pixel_of_tap(ivec2 tap) {
    int divisor = int(volume.divisor);
    return min(tap * divisor + divisor / 2, ivec2(volume.picture.xy) - 1);
}

void main() {
    // Neighbours in a register stand four by two, not eight in a row: their rays meet more of the same.
    uint lane = gl_LocalInvocationIndex;
    uvec4 those = marched_taps();
    uvec2 in_group = uvec2((lane & 3u) + (lane >> 3 & 1u) * 4u, (lane >> 2 & 1u) + (lane >> 4) * 2u);
    ivec2 tap = ivec2(those.xy + 8u * gl_WorkGroupID.xy + in_group);
    if (any(greaterThanEqual(tap, ivec2(those.zw)))) return;
    ivec2 pixel = pixel_of_tap(tap);
    ViewRay ray = ray_of(pixel);
    Marched m = march(ray);
    if (frame.debug_view >= LODE_DEBUG_VOLUME_BRICKS) m = shown_as(m, ray);
    if (volume.divisor == 1u) {
        result[uint(pixel.y) * volume.picture.x + uint(pixel.x)] = packed_result(m);
    } else {
        // Where the scene cut it off, behind which more may be; else none.
        float limit = m.cut ? ray.scene : no_limit;
        taps[uint(tap.y) * volume.picture.z + uint(tap.x)] =
            uvec4(packed_result(m), floatBitsToUint(m.last), floatBitsToUint(limit));
    }
}
