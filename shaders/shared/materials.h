// The table of materials, declared once for C++ and GLSL: texels of four words (shaders/shared/materials.glsl).
#ifndef LODESTONE_MATERIALS_H
#define LODESTONE_MATERIALS_H

// By what a surface is lit.
#define LODE_SHADING_PLAIN 0
#define LODE_SHADING_METALLIC_ROUGHNESS 1
#define LODE_SHADING_UNLIT 2

// What alpha does.
#define LODE_ALPHA_OPAQUE 0
#define LODE_ALPHA_MASK 1
#define LODE_ALPHA_BLEND 2

// Beside it: the surface is shown from behind, too.
#define LODE_TWO_SIDED 256

// The textures of a material.
#define LODE_TEXTURE_BASE_COLOUR 0
#define LODE_TEXTURE_METALLIC_ROUGHNESS 1
#define LODE_TEXTURE_NORMAL 2
#define LODE_TEXTURE_OCCLUSION 3
#define LODE_TEXTURE_EMISSION 4
#define LODE_MATERIAL_TEXTURES 5

// The least roughness that is lit.
#define LODE_SMOOTHEST 0.045
// Level k of n of an environment is what is mirrored with a roughness of (k / (n - 1)) to the power of this.
#define LODE_LEVELS_BY_ROUGHNESS 1.5

#define LODE_WRAP_REPEAT 0
#define LODE_WRAP_CLAMP 1
#define LODE_WRAP_MIRROR 2
// Beside both directions' wrap: the matrix is not 1; u and v are of the second set.
#define LODE_TEXTURE_MOVED 0x10000u
#define LODE_TEXTURE_SECOND 0x20000u

// Specialisation constants of every pipeline: what the scene's materials ask for, for software rasterisers run every
// branch of a shader; how many texture arrays there are.
#define LODE_LOOKS_CONSTANT 12
#define LODE_TEXTURE_ARRAYS_CONSTANT 11
// 1 where what is blended is drawn, and nothing else.
#define LODE_BLENDING_CONSTANT 10

// Bits below: some material has texture k.
#define LODE_LOOKS_METALLIC_ROUGHNESS 32
#define LODE_LOOKS_UNLIT 64
#define LODE_LOOKS_EMISSION 128
#define LODE_LOOKS_MASK 256
#define LODE_LOOKS_BLEND 512
#define LODE_LOOKS_PLACES 1024  // a texture is looked up elsewhere than at the texture coordinates
#define LODE_LOOKS_WRAPS 2048   // one does not repeat
#define LODE_LOOKS_TWO_SIDED 4096
#define LODE_LOOKS_ONE_SIDED 8192
#define LODE_LOOKS_MIRRORS 16384      // instances may be mirrored
#define LODE_LOOKS_ENVIRONMENT 32768  // light from all around is more than a sky and a ground of one colour each
#define LODE_LOOKS_SECOND_UVS 65536   // a texture is on the second set of texture coordinates

// Images of one size and kind are the layers of an array.
#define LODE_MOST_TEXTURE_ARRAYS 8
#define LODE_NO_TEXTURE 0xffffffffu

#define LODE_MATERIAL_TEXELS 14

#ifdef __cplusplus
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
namespace lodestone::gpu {

struct TextureConstants {
    glm::vec4 turn;            // the first two columns of the matrix that texture coordinates are multiplied by
    float move_x, move_y;      // the third
    uint32_t array_and_layer;  // array << 24 | layer, LODE_NO_TEXTURE where there is none
    uint32_t wrap;             // across | down << 8 | LODE_TEXTURE_MOVED | LODE_TEXTURE_SECOND
};
struct MaterialConstants {
    glm::vec4 base_colour;  // linear
    glm::vec3 emission;     // linear
    float occlusion_strength;
    float metallic, roughness, normal_scale, alpha_cutoff;
    uint32_t shading;
    uint32_t alpha_mode;  // | LODE_TWO_SIDED
    uint32_t base_array_and_layer;
    uint32_t textures;  // bit k where texture k is there
    TextureConstants texture[LODE_MATERIAL_TEXTURES];
};
static_assert(sizeof(MaterialConstants) == 16 * LODE_MATERIAL_TEXELS);

}  // namespace lodestone::gpu
#endif

#endif
