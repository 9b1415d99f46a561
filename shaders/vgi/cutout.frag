#version 460
#extension GL_GOOGLE_include_directive : require
// Depths of virtual geometry images that have holes in their materials.
#include "shared/vgi_inputs.glsl"

void main() {
    if (!is_drawn_here(visible_here(), own_uvs_here())) discard;
}
