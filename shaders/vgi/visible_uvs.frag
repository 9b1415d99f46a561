#version 460
#extension GL_GOOGLE_include_directive : require
// As shaders/vgi/visible.frag, of scenes where leaves have texture coordinates of their own.
#include "shared/vgi_inputs.glsl"

layout(location = 0) out uvec4 out_visible;
layout(location = 1) out uvec4 out_uvs;

void main() {
    OwnUvs own = own_uvs_here();
    out_visible = visible_here();
    out_uvs = packed_uvs(own);
    if (!is_drawn_here(out_visible, own)) discard;
}
