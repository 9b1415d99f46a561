// How surfaces look: the materials and textures of glTF 2.0 (Khronos, "glTF 2.0 Specification", 2021, section 3.9).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/mat3x2.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <string>
#include <vector>

namespace lodestone {

// 8-bit texels, rows top to bottom, no padding. Colours are sRGB; what else images hold is as it is.
struct Image {
    uint32_t width = 0, height = 0;   // texels
    std::vector<glm::u8vec4> texels;  // width * height
};

// How an image goes on beyond texture coordinates 0 .. 1.
enum class Wrap : uint8_t {
    repeat,  // it begins again
    clamp,   // its last texel goes on
    mirror,  // it begins again, turned round
};

// An image that a material looks up.
struct Texture {
    int32_t image = -1;                                    // into TriMesh::images, -1 for none
    std::array<Wrap, 2> wrap{Wrap::repeat, Wrap::repeat};  // across and down
    glm::mat3x2 place{{1, 0}, {0, 1}, {0, 0}};             // times (u, v, 1) is where it is looked up
    bool second = false;                       // u and v are of the second set of texture coordinates, not of the first
    bool there() const { return image >= 0; }  // whether there is one
    bool operator==(const Texture&) const = default;
};

// By what a surface is lit.
enum class Shading : uint8_t {
    plain,               // matte, with a faint gloss: files that know colours alone
    metallic_roughness,  // glTF's model: GGX and Lambert, by `metallic` and `roughness`
    unlit,               // not: its base colour is what is seen (KHR_materials_unlit)
};

// What alpha does.
enum class AlphaMode : uint8_t {
    opaque,  // nothing
    mask,    // below `alpha_cutoff` nothing is drawn, above everything
    blend,   // so much is drawn over what lies behind
};

// How a part of the surface looks. Factors multiply what textures hold.
struct Material {
    std::string name;                          // as in the file, UTF-8; may be empty
    glm::vec4 base_colour{1, 1, 1, 1};         // linear RGB and alpha, 0 .. 1, multiplies texture and vertex colour
    Texture base_colour_texture;               // sRGB and alpha; on the first set, its place is the identity
    Shading shading = Shading::plain;          // by what it is lit
    AlphaMode alpha_mode = AlphaMode::opaque;  // what alpha does
    float alpha_cutoff = 0.5f;                 // of AlphaMode::mask
    bool double_sided = false;                 // shown from behind, too

    float metallic = 0, roughness = 1;   // 0 .. 1
    Texture metallic_roughness_texture;  // green roughness, blue metallic
    float normal_scale = 1;              // of the first two components
    Texture normal_texture;              // in the tangent frame of its texture coordinates; green points up
    float occlusion_strength = 1;        // 0 .. 1
    Texture occlusion_texture;           // red: how much of the light from all around is seen
    glm::vec3 emission{0, 0, 0};         // linear, 0 and more
    Texture emission_texture;            // sRGB
    bool operator==(const Material&) const = default;

    // All of them, in the order of the members.
    std::array<const Texture*, 5> textures() const {
        return {&base_colour_texture, &metallic_roughness_texture, &normal_texture, &occlusion_texture,
                &emission_texture};
    }
    // The same, to be changed.
    std::array<Texture*, 5> textures() {
        return {&base_colour_texture, &metallic_roughness_texture, &normal_texture, &occlusion_texture,
                &emission_texture};
    }
};

// Whether texture k of Material::textures() holds colours, which are sRGB; what others hold is as it is.
constexpr bool holds_colours(size_t k) { return k == 0 || k == 4; }

// What Material::textures() are, for people.
inline constexpr std::array<const char*, 5> texture_names = {"base colour", "metallic-roughness", "normals",
                                                             "occlusion", "emission"};

// Whether a texture of the materials is looked up in the second set of texture coordinates.
inline bool use_second_set(std::span<const Material> table) {
    for (const Material& material : table) {
        for (const Texture* texture : material.textures()) {
            if (texture->there() && texture->second) return true;
        }
    }
    return false;
}

// Takes off a material one of its textures that cannot be had. Emission and metal go with theirs: what the texture
// would not have let through is not known.
inline void leave_out(Material& material, Texture& texture) {
    if (&texture == &material.metallic_roughness_texture) material.metallic = 0;
    if (&texture == &material.emission_texture) material.emission = glm::vec3(0);
    texture = {};
}

}  // namespace lodestone
