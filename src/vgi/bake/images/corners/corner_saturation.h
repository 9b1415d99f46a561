// Errors and radii of corners as the forest has them (vgi/asset/corners.h): saturated, first by what their charts want,
// then corner by corner, those that go first to those that stand for them.
//
//   What saturation is: vgi/asset/saturation.h.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/error_codes.h"

namespace lodestone::vgi {

// What becomes of a corner.
struct CornerFate {
    uint32_t parent;
    double error = 0, radius = 0;  // object units; of the surface around it, as its collapse leaves it
};

class CornerSaturation {
public:
    // of: per corner of a chart, the number of the glued one. positions: per glued corner; must outlive this.
    CornerSaturation(const Atlas& atlas, std::span<const uint32_t> of, std::span<const glm::dvec3> positions);

    // Before any is run. Per corner: what its error is at least, by what its charts are off; object units.
    const std::vector<double>& least_errors() const { return error_; }
    // Codes of the errors of a component's corners, rising. order: in which they went. fates: per corner of all.
    std::vector<uint8_t> codes(std::span<const uint32_t> order, std::span<const CornerFate> fates) const;
    // Sets errors and radii of a component's corners. codes: those, or larger ones, rising. corners: per corner of all.
    void run(std::span<const uint32_t> order, std::span<const uint8_t> codes, std::span<const CornerFate> fates,
             std::span<Corner> corners);

private:
    // What a corner is wanted for, too.
    struct Below {
        double error, ratio, radius;
        glm::dvec3 at;
    };
    // ratio: how many times as large the corner's error has to be.
    void add(uint32_t corner, uint8_t error, double ratio, uint8_t radius, const glm::dvec3& at);

    const std::span<const glm::dvec3> positions_;
    const double extent_;
    const ErrorCodes codes_;
    std::vector<double> error_;  // per corner: at least
    std::vector<std::vector<Below>> below_;
};

}  // namespace lodestone::vgi
