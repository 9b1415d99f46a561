#include "vgi/asset/error_codes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/check.h"

namespace lodestone::vgi {

namespace {

constexpr double error_steps = 8, radius_steps = 2;     // per octave
constexpr double most_radius = 16;                      // extents
constexpr double any_radius = 1e9;                      // extents: from where all is less than a dot
constexpr double squared_extent = 3.0 * 65535 * 65535;  // steps of the lattice

// 2^((code - 255) / steps) by code.
std::array<double, 256> powers(double steps) {
    std::array<double, 256> all{};
    for (int code = 1; code < 256; ++code) all[static_cast<size_t>(code)] = std::exp2((code - 255) / steps);
    return all;
}

}  // namespace

ErrorCodes::ErrorCodes(double extent) {
    // Every cut of every instance has its own.
    static const std::array<double, 256> errors = powers(error_steps), radii = powers(radius_steps);
    for (size_t code = 0; code < 256; ++code) {
        errors_[code] = static_cast<float>(extent * errors[code]);
        radii_[code] = static_cast<float>(extent * most_radius * radii[code]);
    }
    radii_[absent] = 0;
    radii_[everywhere] = static_cast<float>(extent * any_radius);
}
uint8_t ErrorCodes::of_error(double error) const {
    const auto at = std::lower_bound(errors_.begin(), errors_.end(), static_cast<float>(error));
    LODE_CHECK(at != errors_.end(), error, errors_.back());
    return static_cast<uint8_t>(at - errors_.begin());
}
uint8_t ErrorCodes::of_radius(double radius) const {
    const auto at = std::lower_bound(radii_.begin(), radii_.end() - 1, static_cast<float>(radius));
    return static_cast<uint8_t>(at - radii_.begin());
}

uint8_t error_code_of_squared(double squared) {
    if (squared <= 0) return 0;
    // Eighths of an octave are quarters of one of the square.
    constexpr std::array<double, 4> quarters{0.5, 0.59460355750136053, 0.70710678118654752, 0.84089641525371454};
    // The number as 2^octave times 0.5 .. 1.
    const auto bits = std::bit_cast<uint64_t>(squared / squared_extent);
    const int octave = static_cast<int>(bits >> 52) - 1022;
    const auto part = std::bit_cast<double>((bits & (~uint64_t{0} >> 12)) | uint64_t{1022} << 52);
    const int above = (part > quarters[0]) + (part > quarters[1]) + (part > quarters[2]) + (part > quarters[3]);
    return static_cast<uint8_t>(std::clamp(255 + 4 * (octave - 1) + above, 1, 255));
}

}  // namespace lodestone::vgi
