#include "mesh/textures/texture_lookup.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>

#include "base/looks/srgb.h"

namespace lodestone {

namespace {

using Bytes = std::array<float, 256>;

// What bytes stand for.
const Bytes& values_of(Texels texels) {
    static const Bytes shares = [] {
        Bytes made{};
        for (size_t i = 0; i < made.size(); ++i) made[i] = static_cast<float>(i) / 255;
        return made;
    }();
    return texels == Texels::colours ? linear_of_bytes() : shares;
}

// The texel of an image that goes on. at: a whole number.
size_t texel_of(double at, uint32_t size, Wrap wrap) {
    if (at >= 0 && at < size) return static_cast<size_t>(at);
    if (!std::isfinite(at)) return 0;
    if (wrap == Wrap::clamp) return static_cast<size_t>(std::clamp(at, 0.0, static_cast<double>(size) - 1));
    const double period = wrap == Wrap::mirror ? 2.0 * size : size, rest = std::fmod(at, period);
    const double within = rest < 0 ? rest + period : rest;
    return static_cast<size_t>(within < size ? within : 2.0 * size - 1 - within);
}

Image half_of(const Image& image, Texels texels) {
    const Bytes& values = values_of(texels);
    const auto byte = [&](float mean) { return texels == Texels::colours ? srgb_byte_of(mean) : byte_of_share(mean); };
    Image half{std::max(image.width / 2, 1u), std::max(image.height / 2, 1u), {}};
    half.texels.reserve(size_t{half.width} * half.height);
    for (uint32_t y = 0; y < half.height; ++y) {
        for (uint32_t x = 0; x < half.width; ++x) {
            glm::vec4 sum(0);
            for (uint32_t k = 0; k < 4; ++k) {
                const size_t row = std::min(2 * y + k / 2, image.height - 1),
                             column = std::min(2 * x + k % 2, image.width - 1);
                const glm::u8vec4& t = image.texels[row * image.width + column];
                sum += glm::vec4(values[t.x], values[t.y], values[t.z], static_cast<float>(t.w) / 255);
            }
            half.texels.emplace_back(byte(sum.x / 4), byte(sum.y / 4), byte(sum.z / 4), byte_of_share(sum.w / 4));
        }
    }
    return half;
}

}  // namespace

glm::vec4 looked_up(const Image& image, Texels texels, const glm::dvec2& uv, const std::array<Wrap, 2>& wrap) {
    const Bytes& values = values_of(texels);
    const double x = uv.x * image.width - 0.5, y = uv.y * image.height - 0.5, left = std::floor(x), top = std::floor(y);
    const size_t x0 = texel_of(left, image.width, wrap[0]), x1 = texel_of(left + 1, image.width, wrap[0]);
    const size_t y0 = texel_of(top, image.height, wrap[1]), y1 = texel_of(top + 1, image.height, wrap[1]);
    const auto fx = static_cast<float>(x - left), fy = static_cast<float>(y - top);
    const auto at = [&](size_t column, size_t row) {
        const glm::u8vec4& t = image.texels[row * image.width + column];
        return glm::vec4(values[t.x], values[t.y], values[t.z], static_cast<float>(t.w) / 255);
    };
    return glm::mix(glm::mix(at(x0, y0), at(x1, y0), fx), glm::mix(at(x0, y1), at(x1, y1), fx), fy);
}

MippedImage::MippedImage(const Image& image, Texels texels) : image_(&image), texels_(texels) {
    for (;;) {
        const Image& last = halves_.empty() ? *image_ : halves_.back();
        if (last.width <= 1 && last.height <= 1) return;
        halves_.push_back(half_of(last, texels_));
    }
}

glm::vec4 MippedImage::at(const glm::dvec2& uv, double level, const std::array<Wrap, 2>& wrap) const {
    const double most = static_cast<double>(halves_.size()),
                 in = std::clamp(std::isfinite(level) ? level : 0.0, 0.0, most);
    const auto lower = static_cast<size_t>(in);
    const auto of = [&](size_t l) { return looked_up(l == 0 ? *image_ : halves_[l - 1], texels_, uv, wrap); };
    const auto share = static_cast<float>(in - std::floor(in));
    return share > 0 ? glm::mix(of(lower), of(lower + 1), share) : of(lower);
}

}  // namespace lodestone
