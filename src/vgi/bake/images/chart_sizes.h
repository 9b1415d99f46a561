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

// Of positions, or of attributes.
struct ChartSizes {
    uint32_t cells = 0;                   // per side of a whole chart
    std::vector<uint8_t> trimmed_levels;  // per chart: finest levels that it leaves out
    // Per chart: of those it has, the finest ones without samples of their own; empty for none.
    std::vector<uint8_t> unsampled_levels{};

    uint32_t levels_of(uint32_t chart) const { return unsampled_levels.empty() ? 0 : unsampled_levels[chart]; }
};

struct SizesWanted {
    uint32_t clusters = 0, cells = 0;
    double most_texels = 0;            // of all charts; for more, cells are fewer
    double needed_for_a_triangle = 4;  // samples that a small component keeps
};

// members: triangles of each chart.
ChartSizes chart_sizes(const Surface& surface, const std::vector<std::vector<uint32_t>>& members,
                       const ChartComplex& patches, const SizesWanted& wanted);

// Of positions, each chart as fine as it has triangles: with at most needed_for_a_triangle samples for each, but 3^2 at
// least, or 9^2 where charts are few. triangles: of each chart, parts of triangles counted as such. most_texels is not
// looked at.
ChartSizes sizes_by_triangles(std::span<const double> triangles, const ChartComplex& patches,
                              const SizesWanted& wanted);

// Of attributes, where textures are baked into them: every component has three quarters to three times as many samples
// as texels, but no fewer than of positions. texels: of each chart, parts of texels included.
ChartSizes texture_sizes(std::span<const double> texels, const ChartComplex& patches, const ChartSizes& positions);
// Per chart: samples of attributes for a texel of its component; 0 where there are no texels.
std::vector<double> samples_per_texel(std::span<const double> texels, const ChartComplex& patches,
                                      const ChartSizes& sizes);

}  // namespace lodestone::vgi
