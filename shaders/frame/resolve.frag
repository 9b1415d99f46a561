#version 460
#extension GL_GOOGLE_include_directive : require
// What the colour stage and effects left, as it is shown.
#include "shared/frame.glsl"

layout(location = 0) out vec4 out_colour;

void main() { out_colour = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0); }
