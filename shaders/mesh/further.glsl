// What indexed meshes have beside their vertices: second texture coordinates and tangents. Shaders that read them define
// LODE_HAS_FURTHER, others have none.
#ifndef LODESTONE_FURTHER_GLSL
#define LODESTONE_FURTHER_GLSL

#include "mesh/tangents.glsl"
#include "shared/draw_constants.h"
#include "shared/surface.glsl"

struct Further {
    vec2 second_uv;
    vec4 tangent;  // of unit length, and the bitangent's sign; 0 where there is none
};

#ifdef LODE_HAS_FURTHER
#include "shared/texels.glsl"

LODE_POOL(LODE_MESH_FURTHER, further, uint, 1)

vec4 unpack_tangent(uint word) {
    if ((word & LODE_TANGENT_THERE) == 0u) return vec4(0.0);
    ivec2 steps = ivec2(bitfieldExtract(int(word), 0, LODE_TANGENT_BITS),
                        bitfieldExtract(int(word), LODE_TANGENT_BITS, LODE_TANGENT_BITS));
    return vec4(unpack_normal(vec2(steps) / float(LODE_TANGENT_STEPS)), (word & LODE_TANGENT_MIRRORED) != 0u ? -1.0 : 1.0);
}

// vertex: of the asset.
Further further_of(uint vertex) {
    uint begin = draw_constants.words[LODE_MESH_WORD_FURTHER], word = (begin - 1u + vertex) * LODE_MESH_FURTHER_WORDS;
    Further found = Further(vec2(0.0), vec4(0.0));
    if (begin == 0u) return found;
    if (scene_has(LODE_LOOKS_SECOND_UVS))
        found.second_uv = uintBitsToFloat(uvec2(further_at(word), further_at(word + 1u)));
    if (uses_tangents()) found.tangent = unpack_tangent(further_at(word + 2u));
    return found;
}
#else
Further further_of(uint vertex) { return Further(vec2(0.0), vec4(0.0)); }
#endif

#endif
