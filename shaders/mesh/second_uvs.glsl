// Second texture coordinates of indexed meshes. Shaders that read them define LODE_TWO_UVS, others have none.
#ifndef LODESTONE_SECOND_UVS_GLSL
#define LODESTONE_SECOND_UVS_GLSL

#include "shared/draw_constants.h"
#include "shared/mesh_vertex.h"

#ifdef LODE_TWO_UVS
#include "shared/texels.glsl"

LODE_POOL(LODE_MESH_SECOND_UVS, second_uvs, uvec2, 2)

// vertex: of the asset.
vec2 second_uv_of(uint vertex) {
    uint begin = draw_constants.words[LODE_MESH_WORD_SECOND_UVS];
    return begin == 0u ? vec2(0.0) : uintBitsToFloat(second_uvs_at(begin - 1u + vertex));
}
#else
vec2 second_uv_of(uint vertex) { return vec2(0.0); }
#endif

#endif
