#version 460
#extension GL_GOOGLE_include_directive : require
// A node of a grid cut, on its way to the tessellator.
#include "shared/frame.glsl"
#include "shared/vgi_texels.h"

layout(location = 0) out uint out_first;  // its first word
layout(location = 1) out uint out_instance;

void main() {
    out_first = draw_constants.words[LODE_VGI_WORD_PATCH] + uint(gl_VertexIndex) * LODE_VGI_PATCH_WORDS;
    out_instance = instance_id_at(gl_InstanceIndex);
}
