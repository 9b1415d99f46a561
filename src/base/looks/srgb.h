// The sRGB transfer function (IEC 61966-2-1), both ways; values 0 .. 1.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace lodestone {

inline double linear_from_srgb(double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }
inline double srgb_from_linear(double c) { return c <= 0.0031308 ? c * 12.92 : 1.055 * std::pow(c, 1 / 2.4) - 0.055; }

// Of each number 0 .. 255.
inline const std::array<float, 256>& linear_of_bytes() {
    static const auto table = [] {
        std::array<float, 256> made{};
        for (size_t i = 0; i < made.size(); ++i)
            made[i] = static_cast<float>(linear_from_srgb(static_cast<double>(i) / 255));
        return made;
    }();
    return table;
}
inline float linear_of_byte(int32_t byte) { return linear_of_bytes()[static_cast<size_t>(byte)]; }
// The nearest number 0 .. 255 to a share of it; what is beyond 0 .. 1 is brought into it. Then the same in sRGB.
inline uint8_t byte_of_share(float share) {
    return static_cast<uint8_t>(std::lround(255 * std::clamp(share, 0.0f, 1.0f)));
}
inline uint8_t srgb_byte_of(float linear) {
    return static_cast<uint8_t>(std::lround(255 * srgb_from_linear(std::clamp(static_cast<double>(linear), 0.0, 1.0))));
}

}  // namespace lodestone
