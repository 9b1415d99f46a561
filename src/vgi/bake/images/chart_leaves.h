// Stage 8 of the atlas: leaves (vgi/asset/leaves/leaves.h). The source's triangles of a chart are cut along the sides
// of the squares of its finest pages, by splitting edges, so that neighbours stay neighbours; what lies in a square is
// its leaf. Places on the square are integers, and those on a chart's side are read along the arc, so that the charts
// on both its sides have the same points.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/bake/images/parameterise.h"
#include "vgi/bake/images/resample.h"

namespace lodestone::vgi {

// Of one chart, by square, row by row.
struct ChartLeaves {
    std::vector<double> errors, radii;         // object units: what samples are off by in place of it; Leaf::radius
    std::vector<std::array<double, 4>> sides;  // object units: what the leaf is off by, by side, beside samples
    std::vector<uint32_t> parts;               // how many the leaf has: 0 where there is none
    ByteLists coded;                           // parts, leaf after leaf
};

// The leaves of the chart of a quad that has been sampled; none at all where it could not be cut.
ChartLeaves make_leaves(const ResampleInput& input, const Atlas& atlas, const SampleDepths& depths, uint32_t quad,
                        const Chart& chart);

// Puts the leaves of all charts into the atlas.
void take_leaves(std::vector<ChartLeaves> charts, Atlas& atlas);

}  // namespace lodestone::vgi
