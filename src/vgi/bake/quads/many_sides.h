// Clusters with many sides are halved before they are cut into quads: each of their rays crosses what the rays before
// it made, so a cluster of hundreds of sides, as between the small parts of a machine, would become millions of
// triangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

constexpr uint32_t most_sides = 10;  // that a cluster is cut into quads with

// What became of clusters 0 .. count - 1: those made of them come after.
struct HalvedClusters {
    uint32_t count = 0;                 // of clusters now
    std::vector<uint32_t> made_of;      // per cluster now, the cluster it was
    std::vector<uint32_t> left_larger;  // that could not be halved, in rising order
    std::vector<uint32_t> twins;        // of the surface now
    ChartComplex patches;               // clusters now
};

// Halves clusters along lines on a disk (cluster_cut.h), from corner to corner, until none has more than most_sides.
// The surface is cut along the lines, and `label` follows its triangles. corners: vertices that are corners even where
// only two clusters meet. Fault::invariant where trace_charts fails, Fault::interrupted where it is told to stop.
Result<HalvedClusters> halve_clusters(Surface& surface, std::vector<uint32_t>& label, uint32_t count,
                                      std::span<const uint32_t> corners, const Progress& progress);

}  // namespace lodestone::vgi
