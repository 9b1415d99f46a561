// Pictures of all that is around, in which columns are as far apart as angles to the side, and rows as angles to the
// top. Read from Radiance's picture files (.hdr).
//
//   Ward, "Real pixels", Graphics Gems II, 1991; Radiance's documentation of its file formats (the run lengths)
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/ext/vector_uint4_sized.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/result.h"

namespace lodestone {

struct Panorama {
    uint32_t width = 0, height = 0;   // texels; twice as wide as high
    std::vector<glm::u8vec4> texels;  // rows top to bottom: three mantissas and an exponent they share
    float scale = 1;                  // times which is radiance

    glm::vec3 at(uint32_t x, uint32_t y) const;  // linear radiance
    // From a direction of unit length, bilinear. Up is +y; the middle column is what lies towards -z, and what lies
    // towards +x is to the right of it.
    glm::vec3 towards(const glm::vec3& direction) const;
    // Points along a side of a cube's texel that radiance is to be asked for, so that no texel is left out.
    uint32_t points_for(uint32_t cube_side) const;
};

inline constexpr uint32_t most_panorama_width = 16384;  // texels: half a gigabyte

// Radiance's picture files: RGBE, flat or in run lengths of either kind, rows from the top and columns from the left.
// Fault::format, naming the file, where it is something else, is cut short, or is wider than most_panorama_width.
Result<Panorama> read_panorama(const std::filesystem::path& path);
// The same of a file in memory. name: for messages.
Result<Panorama> decode_panorama(std::span<const std::byte> bytes, const std::string& name);

}  // namespace lodestone
