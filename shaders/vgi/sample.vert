#version 460
#extension GL_GOOGLE_include_directive : require
// Samples of virtual geometry images by index (shared/vgi_texels.h).
#include "shared/vgi_vertex.glsl"

// LODE_VGI_KIND_..., of the vertices there may be. Software rasterisers run every branch.
layout(constant_id = 0) const uint kinds = LODE_VGI_EVERY_KIND;
const uint leaves = LODE_VGI_KIND_LEAVES | LODE_VGI_KIND_MOVING_LEAVES;

void main() {
    uint id = instance_id_at(gl_InstanceIndex);
    InstanceConstants instance = instance_at(id);
    if (kinds == LODE_VGI_KIND_CORNERS || ((kinds & LODE_VGI_KIND_CORNERS) != 0u && (uint(gl_VertexIndex) & LODE_VGI_CORNER) != 0u)) {
        pass_on(pull_corner(uint(gl_VertexIndex) & ~LODE_VGI_CORNER, instance), id);
        return;
    }
    if ((kinds & ~leaves) == 0u || ((kinds & leaves) != 0u && (uint(gl_VertexIndex) & LODE_VGI_LEAF) != 0u)) {
        pass_on(pull_leaf(uint(gl_VertexIndex) & ~(LODE_VGI_LEAF | LODE_VGI_LEAF_MOVES),
                          (kinds & LODE_VGI_KIND_MOVING_LEAVES) != 0u, instance),
                id);
        return;
    }
    uint place = uint(gl_VertexIndex) % LODE_VGI_PAGE_TEXELS;
    uint row = asset_at(draw_constants.words[LODE_VGI_WORD_ASSET]).page_cells + 1u;
    uint y = uint((float(place) + 0.5) / float(row));  // place / row, which software rasterisers divide one by one
    pass_on(pull_sample(uint(gl_VertexIndex) / LODE_VGI_PAGE_TEXELS, ivec2(int(place - y * row), int(y)),
                        (kinds & LODE_VGI_KIND_CORNER_SAMPLES) != 0u, instance),
            id);
}
