// How evenly the levels of a progressive mesh can be asked for.
#pragma once

#include <cstdint>

#include "lod/asset/progressive_mesh.h"

namespace lodestone {

struct LevelSteps {
    double diagonal = 0;           // of the box around the vertices, object units
    uint32_t distinct_errors = 0;  // of all levels, full detail's 0 included
    // Triangles that go when an error grows by 1%, as a share of those drawn before: of 2,000 errors, evenly spread
    // over the logarithm from the smallest above 0 to the largest that draws more than 2,000 triangles. 0 .. 1; 0 where
    // no level has more.
    double largest_step = 0, median_step = 0;
};
LevelSteps level_steps(const ProgressiveMesh& pm);

}  // namespace lodestone
