// What lies between charts in a baked image.
#pragma once

#include <cstdint>
#include <vector>

#include "base/looks/material.h"

namespace lodestone {

// Texels that are not covered take the mean of those around them that are, four times over; then all others that of
// larger and larger squares. nothing: of an image that has no texel covered.
void fill_around(Image& image, std::vector<uint8_t>& covered, const glm::u8vec4& nothing);

}  // namespace lodestone
