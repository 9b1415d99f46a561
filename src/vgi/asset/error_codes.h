// Errors and radii of samples (sample_errors.h) as codes of a byte: logarithmic, and rounded up.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

namespace lodestone::vgi {

inline constexpr double rounding = 1e-6;  // what float arithmetic may lose of an error or a radius, as a share

// Eighths of an octave for errors, halves for radii; 0 is 0. The largest radius is as good as none: it holds all that
// has a radius. A chart's corners, which are always there, have the largest of both.
// extent: Atlas::extent(), object units.
class ErrorCodes {
public:
    static constexpr uint8_t everywhere = 255;  // a radius
    static constexpr uint8_t absent = 1;        // a radius, 0, of samples that are never there (sample_depths.h)

    explicit ErrorCodes(double extent);
    uint8_t of_error(double error) const;    // object units, 0 .. extent
    uint8_t of_radius(double radius) const;  // object units; everywhere from 11.3 extents on
    float error(uint8_t code) const { return errors_[code]; }
    float radius(uint8_t code) const { return radii_[code]; }

private:
    std::array<float, 256> errors_, radii_;
};

// Of samples: the largest code of their errors, and of their radii.
struct SampleCodes {
    uint8_t error = 0, radius = 0;
};

// Where there are no leaves, errors of the finest samples, of which there are most, take every fourth code, those of
// the next level every second: they are bounds, and half an octave there costs little where a code's bits cost much.
// level: of a chart's own, 0 the finest.
constexpr uint32_t error_code_shift(uint32_t level) { return level == 0 ? 2 : level == 1 ? 1 : 0; }
// 255, the largest, stays.
constexpr uint8_t round_up(uint32_t error_code, uint32_t level) {
    const uint32_t shift = error_code_shift(level);
    return static_cast<uint8_t>(std::min(255u, (error_code + (1u << shift) - 1) >> shift << shift));
}

// of_error() of a distance in steps of the lattice, squared; to the bit the same on every machine, as no function of
// a mathematical library is asked. squared: >= 0.
uint8_t error_code_of_squared(double squared);

}  // namespace lodestone::vgi
