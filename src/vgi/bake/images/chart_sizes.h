// How finely charts are sampled. A small component has more charts than its share of the surface comes to: they leave
// out levels, until samples are about as far apart there as elsewhere, but not farther than its own triangles need.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

inline constexpr double usual_charts_per_cluster = 6;

struct ChartSizes {
    uint32_t cells = 0;                   // per side of a whole chart
    std::vector<uint8_t> trimmed_levels;  // per chart: Atlas::trimmed_levels
};

struct SizesWanted {
    uint32_t clusters = 0, cells = 0;
    double most_texels = 0;            // of all charts; for more, cells are fewer
    double needed_for_a_triangle = 4;  // samples that a small component keeps
};

// members: triangles of each chart.
ChartSizes chart_sizes(const Surface& surface, const std::vector<std::vector<uint32_t>>& members,
                       const ChartComplex& patches, const SizesWanted& wanted);

}  // namespace lodestone::vgi
