// The charts as corners of theirs are measured against: grids of few samples, and how far a triangle is from them.
#pragma once

#include <array>
#include <glm/vec3.hpp>

#include "mesh/distance/distance.h"
#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

// Cells a side of a chart's grid; fewer where there are many charts.
uint32_t measured_cells(const Atlas& atlas, uint32_t chart);

class MeasuredCharts {
public:
    explicit MeasuredCharts(const Atlas& atlas);

    // The largest squared distance of a triangle to the charts that was found, or `worst` where that is more; square
    // object units. At its places, then uphill from the farthest of them.
    // hint: a triangle of the charts near to the last one, or ClosestSurface::no_hint; is set.
    double squared_off(const std::array<glm::dvec3, 3>& triangle, double worst, uint32_t& hint) const;

private:
    ClosestSurface charts_;
};

}  // namespace lodestone::vgi
