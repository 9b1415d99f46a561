// How far each level is from the source surface, measured on the surfaces.
#pragma once

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "lod/asset/progressive_mesh.h"

namespace lodestone {

// How closely levels are measured.
struct ErrorCurveOptions {
    uint32_t measured_levels = 48;  // >= 2; spread evenly over the logarithm of the triangle count, the base among them
    uint64_t samples = 100000;      // area-uniform points on each surface and level; every vertex counts besides
    uint64_t seed = 1;              // of the sample points
};

// One error per level, object units, never decreasing, the first 0: the two-sided (Hausdorff) distance between the
// level and the source. At measured levels it is the largest distance found up to there; a level between two measured
// ones gets the coarser one's. All are raised by 10% for what sampling misses, so that the promise errs towards safety.
// Fault::interrupted when progress says stop.
Result<std::vector<float>> measure_errors(const ProgressiveMesh& pm, const ErrorCurveOptions& options = {},
                                          const Progress& progress = {});

}  // namespace lodestone
