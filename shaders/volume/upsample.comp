#version 460
#extension GL_GOOGLE_include_directive : require
// From a smaller target to the picture: the mean of the four nearest taps, of those that fit. A tap fits a pixel where
// its ray saw what the pixel's would: all that the tap met lies before the pixel's surface, and what it was cut off by
// lies about as deep as that. Pixels that no tap fits, and those between whose taps much changes, are listed and marched
// by themselves (misfits.comp).
#include "shared/frame.glsl"
#include "shared/volume.h"
#include "shared/texels.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

const float most_spread = 0.15;  // by which taps may differ, of light or of what shines through

LODE_TEXELS(LODE_VOLUME_TAPS, taps, uvec4)
layout(set = 1, binding = LODE_VOLUME_RESULT, std430) writeonly buffer ResultBlock { uvec2 result[]; };
layout(set = 1, binding = LODE_VOLUME_MISFITS, std430) buffer MisfitBlock { uint misfits[]; };

void main() {
    ivec2 pixel = ivec2(volume.marched.xy + gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(volume.marched.zw)))) return;
    ivec4 those = ivec4(marched_taps());  // the outermost have nothing, like those past them
    vec2 place = (vec2(pixel) - float(volume.divisor / 2u)) / float(volume.divisor);
    ivec2 low = ivec2(floor(place));
    vec2 f = place - vec2(low);
    uint number = uint(pixel.y) * volume.picture.x + uint(pixel.x);
    uvec4 words[4];
    bool empty = true;
    for (int k = 0; k < 4; ++k) {
        ivec2 tap = clamp(low + ivec2(k & 1, k >> 1), those.xy, those.zw - 1);
        words[k] = taps_at(uint(tap.y) * volume.picture.z + uint(tap.x));
        empty = empty && words[k].xy == nothing && uintBitsToFloat(words[k].w) == no_limit;
    }
    if (empty) {
        result[number] = nothing;
        return;
    }
    float n = volume.near_plane, r = volume.far_plane;
    float scene = n * r / (texelFetch(scene_depth, pixel, 0).r * (r - n) + n);
    float tolerance = 2.0 * volume.voxel;
    vec4 sum = vec4(0.0);
    float weights = 0.0;
    vec4 least = vec4(3.4e38), most = vec4(-3.4e38);
    for (int k = 0; k < 4; ++k) {
        float weight = ((k & 1) == 1 ? f.x : 1.0 - f.x) * (k >> 1 == 1 ? f.y : 1.0 - f.y);
        float last = uintBitsToFloat(words[k].z), limit = uintBitsToFloat(words[k].w);
        bool fits = scene >= last - tolerance && scene <= limit + tolerance;
        if (!fits) weight = 0.0;
        weights += weight;
        vec4 tapped = vec4(unpackHalf2x16(words[k].x), unpackHalf2x16(words[k].y));
        sum += weight * tapped;
        if (weight > 0.0) {
            least = min(least, tapped);
            most = max(most, tapped);
        }
    }
    // Where a tap does not fit, those that do stand on one side; and taps may not be at one.
    vec4 spread = most - least;
    bool at_one = max(max(spread.r, spread.g), max(spread.b, spread.a)) < most_spread;
    bool one_sided = weights < 0.999 && (weights <= 0.0 || least.a < 0.99);
    if (one_sided || !at_one) {
        uint at = atomicAdd(misfits[3], 1u);
        misfits[LODE_MISFITS_HEAD + at] = number;
        if (at % LODE_MISFITS_GROUP == 0u) atomicAdd(misfits[0], 1u);
    } else {
        sum /= weights;
        result[number] = uvec2(packHalf2x16(sum.rg), packHalf2x16(sum.ba));
    }
}
