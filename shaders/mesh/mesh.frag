#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/lighting.glsl"
#include "shared/mesh_inputs.glsl"

layout(location = 0) out vec4 out_colour;

void main() { out_colour = shown(mesh_surface()); }
