#version 460
#extension GL_GOOGLE_include_directive : require
// Depths of indexed meshes that have holes in their materials.
#include "mesh/inputs.glsl"

void main() {
    if (!is_drawn(look_of(mesh_surface()))) discard;
}
