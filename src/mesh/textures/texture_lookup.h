// What a texture holds at texture coordinates, looked up on the CPU.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "base/looks/material.h"

namespace lodestone {

// What the bytes of an image mean.
enum class Texels : uint8_t {
    colours,  // sRGB and alpha: looked up as linear numbers
    numbers,  // as they are
};

// An image and its halves, quarters, ... of which each texel is the mean of four, in linear light where they are
// colours.
class MippedImage {
public:
    // image: must outlive this.
    MippedImage(const Image& image, Texels texels);

    // Bilinear in both levels around `level` (0 is the image itself, 1 its half), and between these. uv: origin at the
    // upper left, any range. Channels 0 .. 1.
    glm::vec4 at(const glm::dvec2& uv, double level, const std::array<Wrap, 2>& wrap) const;
    uint32_t width() const { return image_->width; }    // texels, of the image
    uint32_t height() const { return image_->height; }  // texels, of the image

private:
    const Image* image_;
    Texels texels_;
    std::vector<Image> halves_;
};

// Bilinear.
glm::vec4 looked_up(const Image& image, Texels texels, const glm::dvec2& uv, const std::array<Wrap, 2>& wrap);

}  // namespace lodestone
