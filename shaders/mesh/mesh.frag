#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/lighting.glsl"
#include "mesh/inputs.glsl"

layout(location = 0) out vec4 out_colour;

void main() { out_colour = shown(mesh_surface()); }
