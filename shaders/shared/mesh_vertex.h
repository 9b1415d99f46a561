// The vertex of indexed meshes, declared once for C++ and GLSL. 32 bytes.
#ifndef LODESTONE_MESH_VERTEX_H
#define LODESTONE_MESH_VERTEX_H

#define LODE_MESH_POSITION 0  // vec3, object units
#define LODE_MESH_NORMAL 1    // snorm16 x 2, octahedral
#define LODE_MESH_UV 2        // vec2
#define LODE_MESH_COLOUR 3    // unorm8 x 4, sRGB and alpha
#define LODE_MESH_MATERIAL 4  // uint, before the instance's first_material is added

// What lies beside the vertices, where a mesh has second texture coordinates or tangents: FurtherAttributes, by vertex.
// Set 1.
#define LODE_MESH_FURTHER 2
#define LODE_MESH_FURTHER_WORDS 3
// Of Draw::words: 1 + where the asset's begin; 0 where it has none.
#define LODE_MESH_WORD_FURTHER 6
// Specialisation constant: 1 where some asset has tangents.
#define LODE_MESH_TANGENTS_CONSTANT 0

// A tangent is a word: octahedral, in two numbers of 15 bits, of so many steps to 1; whether there is one; and whether
// the bitangent is against cross(normal, tangent).
#define LODE_TANGENT_BITS 15
#define LODE_TANGENT_STEPS 16383
#define LODE_TANGENT_THERE 0x40000000u
#define LODE_TANGENT_MIRRORED 0x80000000u

#ifdef __cplusplus
#include <cstdint>
namespace lodestone {
struct MeshVertex {
    float position[3];
    int16_t normal[2];
    float uv[2];
    uint8_t colour[4];
    uint32_t material;
    bool operator==(const MeshVertex&) const = default;
};
static_assert(sizeof(MeshVertex) == 32);
struct FurtherAttributes {
    float second_uv[2];
    uint32_t tangent;
    bool operator==(const FurtherAttributes&) const = default;
};
static_assert(sizeof(FurtherAttributes) == 4 * LODE_MESH_FURTHER_WORDS);
}  // namespace lodestone
#endif

#endif
