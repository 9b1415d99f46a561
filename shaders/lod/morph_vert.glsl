// Vertices of a progressive mesh on their way to what they become: Hoppe, "Progressive Meshes", SIGGRAPH 1996, section
// 3.1. morphed_vertex.cpp does the same on the CPU.
#include "mesh/outputs.glsl"
#include "shared/lod_morph.h"
#include "shared/texels.glsl"

LODE_POOL(LODE_LOD_VERTICES, vertices, uint, 1)
LODE_POOL(LODE_LOD_PARENTS, parents, uint, 1)

void main() {
    uint first = draw_constants.words[LODE_LOD_WORD_FIRST], staying = draw_constants.words[LODE_LOD_WORD_STAYING];
    float morphing = float(draw_constants.words[LODE_LOD_WORD_ARRIVED] - staying);
    uint place = uint(gl_VertexIndex), material = vertices_at((first + place) * LODE_LOD_VERTEX_WORDS + 7u);
    vec3 position = vec3(0.0), normal = vec3(0.0);
    vec2 uv = vec2(0.0);
    Further further = Further(vec2(0.0), vec4(0.0));
    vec4 colour = vec4(0.0);
    // A wedge is where it belongs by what is left, and for the rest where its parent is, which may be on its way, too.
    for (float left = 1.0; left > 0.0; place = parents_at((first + place) * LODE_LOD_PARENT_WORDS)) {
        uint wedge = parents_at((first + place) * LODE_LOD_PARENT_WORDS + 1u);
        float away = wedge < staying ? 0.0 : float(wedge - staying + 1u) / (morphing + 1.0), here = left * (1.0 - away);
        uint word = (first + place) * LODE_LOD_VERTEX_WORDS;
        position += here * uintBitsToFloat(uvec3(vertices_at(word), vertices_at(word + 1u), vertices_at(word + 2u)));
        normal += here * unpack_normal(unpackSnorm2x16(vertices_at(word + 3u)));
        uv += here * uintBitsToFloat(uvec2(vertices_at(word + 4u), vertices_at(word + 5u)));
        Further there = further_of(place);
        further.second_uv += here * there.second_uv;
        further.tangent += here * there.tangent;
        colour += here * unpackUnorm4x8(vertices_at(word + 6u));
        left *= away;
    }
    pass_on(position, normal, uv, further, colour, material);
}
