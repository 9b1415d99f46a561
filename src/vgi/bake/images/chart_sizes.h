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

// members: triangles of each chart. clusters, cells: wanted. most_texels: of all charts; for more, cells are fewer.
ChartSizes chart_sizes(const Surface& surface, const std::vector<std::vector<uint32_t>>& members,
                       const ChartComplex& patches, uint32_t clusters, uint32_t cells, double most_texels);

}  // namespace lodestone::vgi
