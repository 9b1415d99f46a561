// Samples of the borders between charts: taken once per arc, for the charts on both its sides.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/sample_depths.h"
#include "vgi/bake/charts/chart_complex.h"

namespace lodestone::vgi {

struct BorderSample {
    glm::dvec3 position{0};
    uint32_t segment = 0;  // of the arc
    double share = 0;      // of the segment
};

class Borders {
public:
    // As many samples as the charts beside an arc have attributes there. atlas: laid out.
    Borders(const Surface& surface, const ChartComplex& patches, const Atlas& atlas);

    // step: 0 .. attribute_cells_of the charts, in the arc's direction.
    const BorderSample& at(uint32_t arc, uint32_t step) const { return samples_[arc][step]; }

    // Where two borders leave a corner almost the same way, rounding to the atlas's lattice may turn their first
    // samples over, and no sample inside the chart can make up for it. Such samples of a height field seen from `up`
    // move by a few steps of the lattice, as little as will do.
    void keep_corners_open(const ChartComplex& patches, const Atlas& atlas, const SampleDepths& depths,
                           const glm::dvec3& up);

private:
    std::vector<std::vector<BorderSample>> samples_;  // per arc
};

}  // namespace lodestone::vgi
