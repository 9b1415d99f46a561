#version 460
#extension GL_GOOGLE_include_directive : require
// As many cells as the node has, on all sides: borders are collapsed where the vertices are made.
#include "shared/frame.glsl"
#include "shared/vgi.glsl"

layout(vertices = 1) out;

layout(location = 0) in uint in_first[];
layout(location = 1) in uint in_instance[];
layout(location = 0) out uint out_first[];
layout(location = 1) out uint out_instance[];

void main() {
    uint shape = patch_words[in_first[0]];
    bool drawn = ((shape >> (LODE_VGI_PATCH_VIEWS + draw_constants.view)) & 1u) != 0u;
    float cells = drawn ? float(1u << ((shape >> 4) & 3u)) : 0.0;
    for (int k = 0; k < 4; ++k) gl_TessLevelOuter[k] = cells;
    for (int k = 0; k < 2; ++k) gl_TessLevelInner[k] = cells;
    out_first[gl_InvocationID] = in_first[0];
    out_instance[gl_InvocationID] = in_instance[0];
}
