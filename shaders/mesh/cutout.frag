#version 460
#extension GL_GOOGLE_include_directive : require
// Depths of indexed meshes that have holes in their materials.
#include "mesh/inputs.glsl"

void main() {
    if (may_be_absent(front_here()) && !is_drawn(look_of(mesh_surface()))) discard;
}
