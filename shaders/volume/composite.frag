#version 460
#extension GL_GOOGLE_include_directive : require
// Lays the volumes over the picture: premultiplied, alpha is what shines through.
#include "shared/frame.glsl"
#include "shared/texels.glsl"
#include "shared/volume.h"

layout(location = 0) out vec4 out_colour;

LODE_TEXELS(LODE_VOLUME_RESULT, result, uvec2)

void main() {
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    if (any(lessThan(pixel, volume.marched.xy)) || any(greaterThanEqual(pixel, volume.marched.zw))) discard;
    uvec2 word = result_at(pixel.y * volume.picture.x + pixel.x);
    out_colour = vec4(unpackHalf2x16(word.x), unpackHalf2x16(word.y));
}
