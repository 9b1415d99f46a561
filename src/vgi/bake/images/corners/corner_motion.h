// What corners cost together, on their way. A collapse is measured with all before it done and none after it begun
// (collapse_corners.h). A view has no such order: corners whose errors have one code move at the same time, each from
// where its parent is, which may move, too. Half way something may be farther off than before and after, as where
// a ridge slides down a wall. Then the last of the corners that it moves with takes the next larger code, and so do
// those that went after it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/error_codes.h"
#include "vgi/bake/images/corners/corner_saturation.h"
#include "vgi/bake/images/corners/measured_charts.h"

namespace lodestone::vgi {

class CornerMotion {
public:
    // of: per corner of a chart, the number of the glued one. positions: per glued corner. All must outlive this.
    CornerMotion(const Atlas& atlas, const MeasuredCharts& charts, std::span<const uint32_t> of,
                 std::span<const glm::dvec3> positions);

    // Raises codes, so that what moves with a code is no farther off than its error half way. corners: of a component;
    // order: those that went, as they went; fates: per corner of all; codes: of `order`, rising, as they stay.
    void hold(std::span<const uint32_t> corners, std::span<const uint32_t> order, std::span<const CornerFate> fates,
              std::span<uint8_t> codes) const;

private:
    class Component;
    // Of a triangle of a chart: its corners, and points of it.
    struct Half {
        std::array<uint32_t, 3> corners;
        std::vector<glm::dvec3> points;
    };

    const MeasuredCharts& charts_;
    const std::span<const glm::dvec3> positions_;
    const ErrorCodes codes_;
    std::vector<Half> halves_;                  // two to a chart
    std::vector<std::vector<uint32_t>> first_;  // per corner: halves that have it first
};

}  // namespace lodestone::vgi
