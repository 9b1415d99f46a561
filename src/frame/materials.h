// The materials of a scene: one table and one texture array that every backend's vertices refer to by number.
#pragma once

#include <cstdint>
#include <glm/vec4.hpp>
#include <vector>

namespace lodestone {

// A material as shaders see it.
struct SurfaceMaterial {
    glm::vec4 base_colour{1};  // linear RGB, alpha
    int32_t layer = -1;        // of the texture array, -1 for none
    bool operator==(const SurfaceMaterial&) const = default;
};

// The materials and textures of a scene; all textures have one size.
struct MaterialSet {
    std::vector<SurfaceMaterial> materials;  // at least one
    uint32_t texture_size = 0;               // texels a side of every layer, a power of two; 0 without textures
    uint32_t layers = 0;                     // of the texture array
    std::vector<glm::u8vec4> texels;         // layers * texture_size^2, sRGB, layer by layer, rows top to bottom
};

}  // namespace lodestone
