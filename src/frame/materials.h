// The materials of a scene, as shaders see them: a table that every backend's vertices refer to by number, and the
// images it looks up.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/mat3x2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

namespace lodestone {

// How an image goes on beyond 0 .. 1.
enum class SurfaceWrap : uint8_t {
    repeat,  // it begins again
    clamp,   // its last texel goes on
    mirror,  // it begins again, turned round
};

// An image that a material looks up.
struct SurfaceTexture {
    int32_t image = -1;                         // into MaterialSet::images, -1 for none
    std::array<SurfaceWrap, 2> wrap{};          // across and down
    glm::mat3x2 place{{1, 0}, {0, 1}, {0, 0}};  // times (u, v, 1) is where it is looked up
    bool operator==(const SurfaceTexture&) const = default;
};

// By what a surface is lit.
enum class SurfaceShading : uint8_t {
    plain,               // matte, with a faint gloss
    metallic_roughness,  // GGX and Lambert
    unlit,               // not: its base colour is what is seen
};

// What alpha does.
enum class SurfaceAlpha : uint8_t {
    opaque,  // nothing
    mask,    // below alpha_cutoff nothing is drawn
    blend,   // so much is drawn over what lies behind
};

// The textures of a material.
enum SurfaceTextureRole : uint8_t {
    texture_base_colour,         // sRGB and alpha
    texture_metallic_roughness,  // green roughness, blue metallic
    texture_normal,              // in the frame of its texture coordinates; green points up
    texture_occlusion,           // red: how much of the light from all around is seen
    texture_emission,            // sRGB
    texture_roles,               // how many there are
};

// A material of the scene. Factors multiply what textures hold.
struct SurfaceMaterial {
    glm::vec4 base_colour{1};                            // linear RGB, alpha
    SurfaceShading shading = SurfaceShading::plain;      // by what it is lit
    SurfaceAlpha alpha_mode = SurfaceAlpha::opaque;      // what alpha does
    bool double_sided = false;                           // shown from behind, too
    float alpha_cutoff = 0.5f;                           // of SurfaceAlpha::mask
    float metallic = 0, roughness = 1;                   // 0 .. 1
    float normal_scale = 1, occlusion_strength = 1;      // of textures
    glm::vec3 emission{0};                               // linear
    std::array<SurfaceTexture, texture_roles> textures;  // by SurfaceTextureRole
    bool operator==(const SurfaceMaterial&) const = default;
};

// An image of the scene, rows top to bottom.
struct SurfaceImage {
    uint32_t width = 0, height = 0;   // texels
    bool srgb = true;                 // its first three numbers are sRGB; else all are as they are
    std::vector<glm::u8vec4> texels;  // width * height
    bool operator==(const SurfaceImage&) const = default;
};

// The materials and images of a scene.
struct MaterialSet {
    std::vector<SurfaceMaterial> materials;  // at least one
    std::vector<SurfaceImage> images;        // of any size
    // Whether instances may be mirrored. Where it is not told, what has one side is shown from behind as long as one
    // is.
    bool mirrors = false;

    // Whether a surface is shown from behind, so that views are not to leave out what faces away.
    bool any_double_sided() const {
        return std::ranges::any_of(materials, [](const SurfaceMaterial& m) { return m.double_sided; });
    }
};

}  // namespace lodestone
