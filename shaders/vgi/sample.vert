#version 460
#extension GL_GOOGLE_include_directive : require
// Samples of virtual geometry images by index (shared/vgi_texels.h).
#include "shared/vgi_vertex.glsl"

struct IndexParts {
    uint quotient, rest;
};
// number: below 2^30. Software rasterisers divide integers one by one; a first quotient of floats may be off by what it
// is rounded to, the second is of a number so small that it is exact.
IndexParts divided(uint number, uint by) {
    uint near = uint(float(int(number)) / float(by));
    int rest = int(number - near * by);
    int more = int(floor((float(rest) + 0.5) / float(by)));
    return IndexParts(near + uint(more), uint(rest - more * int(by)));
}

void main() {
    uint id = instance_id_at(gl_InstanceIndex);
    InstanceConstants instance = instance_at(id);
    if (kinds == LODE_VGI_KIND_CORNERS || ((kinds & LODE_VGI_KIND_CORNERS) != 0u && (uint(gl_VertexIndex) & LODE_VGI_CORNER) != 0u)) {
        pass_on(pull_corner(uint(gl_VertexIndex) & ~LODE_VGI_CORNER, instance), id);
        return;
    }
    if (leaves_alone || ((kinds & LODE_VGI_KINDS_OF_LEAVES) != 0u && (uint(gl_VertexIndex) & LODE_VGI_LEAF) != 0u)) {
        pass_on(pull_leaf(uint(gl_VertexIndex) & ~(LODE_VGI_LEAF | LODE_VGI_LEAF_MOVES),
                          (kinds & LODE_VGI_KIND_MOVING_LEAVES) != 0u, instance),
                id);
        return;
    }
    uint cells = asset_at(draw_constants.words[LODE_VGI_WORD_ASSET]).page_cells;
    IndexParts in_pool = divided(uint(gl_VertexIndex), LODE_VGI_PAGE_TEXELS(cells)), in_page = divided(in_pool.rest, cells + 1u);
    pass_on(pull_sample(in_pool.quotient, ivec2(in_page.rest, in_page.quotient),
                        (kinds & LODE_VGI_KIND_CORNER_SAMPLES) != 0u, instance),
            id);
}
