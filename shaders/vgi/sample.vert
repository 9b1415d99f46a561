#version 460
#extension GL_GOOGLE_include_directive : require
// Samples of virtual geometry images by index: slot of the page times LODE_VGI_PAGE_TEXELS, plus the place in it.
#include "shared/vgi_vertex.glsl"

void main() {
    uint id = instance_id_at(gl_InstanceIndex);
    uint place = uint(gl_VertexIndex) % LODE_VGI_PAGE_TEXELS;
    uint row = asset_at(draw_constants.words[LODE_VGI_WORD_ASSET]).page_cells + 1u;
    pass_on(pull_sample(uint(gl_VertexIndex) / LODE_VGI_PAGE_TEXELS, ivec2(int(place % row), int(place / row)),
                        instance_at(id).object_to_world),
            id);
}
