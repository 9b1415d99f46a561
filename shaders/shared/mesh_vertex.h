// The vertex of indexed meshes, declared once for C++ and GLSL. 32 bytes.
#ifndef LODESTONE_MESH_VERTEX_H
#define LODESTONE_MESH_VERTEX_H

#define LODE_MESH_POSITION 0  // vec3, object units
#define LODE_MESH_NORMAL 1    // snorm16 x 2, octahedral
#define LODE_MESH_UV 2        // vec2
#define LODE_MESH_COLOUR 3    // unorm8 x 4, sRGB and alpha
#define LODE_MESH_MATERIAL 4  // uint, before the instance's first_material is added

// Second texture coordinates lie beside the vertices, where a mesh has some: vec2, by vertex. Set 1.
#define LODE_MESH_SECOND_UVS 2
// Of Draw::words: 1 + where the asset's begin; 0 where it has none.
#define LODE_MESH_WORD_SECOND_UVS 6

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
}  // namespace lodestone
#endif

#endif
