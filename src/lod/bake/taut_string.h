// The shortest line through a corridor.
//   Davies, Kovac, "Local extremes, runs, strings and multiresolution", 2001 (the taut string); Lee, Preparata,
//   "Euclidean shortest paths in the presence of rectilinear barriers", 1984 (the funnel).
#pragma once

#include <span>
#include <vector>

namespace lodestone {

// The shortest of all lines from (x[0], low[0]) to (x.back(), high.back()) that stay between low and high at every x:
// its height at every x. No other line between them has a smaller greatest slope, nor a greater smallest one. Rises
// strictly where low and high never fall and low < high everywhere.
// x: strictly rising; low <= high; all of one size, at least 1.
std::vector<double> taut_string(std::span<const double> x, std::span<const double> low, std::span<const double> high);

}  // namespace lodestone
