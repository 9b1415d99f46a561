// Corners of charts, those that are glued taken as one, as a forest above the samples of charts: a corner that is not
// wanted is drawn in the place of the nearest of its ancestors that is, and triangles that get flat by that are left
// out. What is left fits together for any set of wanted corners, as every corner is drawn in one place.
//
//   Xia, Varshney, "Dynamic view-dependent simplification for polygonal models", IEEE Visualization 1996, for merge
//   trees; Hoppe, "View-dependent refinement of progressive meshes", SIGGRAPH 1997.
//
// A corner is wanted as samples are (saturation.h). Its error is at least that of the corners that it stands for, and
// error_ratio times that of the centres of its charts: where anything of a chart is wanted, its four corners are, and
// have arrived in their places.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

inline constexpr uint32_t most_corner_depth = 63;  // parents above a corner

// Which corners are one: a number, 0 .. , for corner k of chart c at 4 c + k, by first use. Corner k is where side k
// begins.
std::vector<uint32_t> glued_corners(const std::vector<GluedSide>& sides);

// The texel of corner k, 0 .. 3, of a chart.
size_t corner_texel(const Atlas& atlas, uint32_t chart, uint32_t k);

// Numbers and order of what Atlas::corners and Atlas::chart_corners hold, with no look at images. None at all are good.
Result<void> validate_corners(const Atlas& atlas);
// Places are those of the images, and errors are saturated.
Result<void> validate_corner_errors(const Atlas& atlas);

}  // namespace lodestone::vgi
