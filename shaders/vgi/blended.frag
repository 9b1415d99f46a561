#version 460
#extension GL_GOOGLE_include_directive : require
// What is blended over the rest of the picture. Each triangle is lit by itself: the visibility buffer has room for one.
#include "shared/lighting.glsl"
#include "shared/vgi_inputs.glsl"

layout(location = 0) out vec4 out_colour;

void main() { out_colour = shown(surface_here(visible_here(), own_uvs_here())); }
