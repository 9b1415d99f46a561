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
    uint64_t samples = 100000;  // area-uniform points on the source and on each level; every vertex counts besides
    uint64_t seed = 1;          // of the sample points
};

// One error per level, object units, strictly rising, the first 0: what is measured of the two-sided (Hausdorff)
// distance between the source and this level or a finer one, times stated_least .. stated_most. Fault::interrupted when
// progress says stop.
Result<std::vector<float>> measure_errors(const ProgressiveMesh& pm, const ErrorCurveOptions& options = {},
                                          const Progress& progress = {});

// The largest measured distance rises by jumps, and levels in between could never be asked for. The errors stated rise
// as evenly as these bounds let them, over the logarithm of the triangles: between jumps they go on, before a jump they
// begin to. The lower is for what sampling misses.
inline constexpr double stated_least = 1.005, stated_most = 1.2;
// By level: the largest distance measured there or before, 0 where nothing is above `resolution`. triangles: by level.
std::vector<float> stated_errors(const std::vector<double>& measured, const std::vector<uint32_t>& triangles,
                                 double resolution);

}  // namespace lodestone
