// Errors for the cuts: of every sample, what leaving it out costs and from how far away that matters; of every page,
// what drawing it as a grid costs, and where it lies and looks.
//
//   Blow, "Terrain rendering at high levels of detail", GDC 2000, for spheres around samples; Pajarola, "Large scale
//   terrain visualization using the restricted quadtree triangulation", IEEE Visualization 1998, for saturation;
//   Lindstrom, Pascucci, "Visualization of large terrains made easy", IEEE Visualization 2001, for both.
//
// A sample m with error E and radius r is wanted from an eye e iff E * Q + r > |m - e|, Q being focal length over pixel
// error: everything within r of m is then far enough for E to stay below the pixel error. Errors and radii are
// saturated: wherever a sample is wanted, so are its parents in the bintree, for every eye and every Q of at least
// least_magnification. A cut is therefore conforming with no look at neighbours, and samples glued together carry the
// same numbers, so it is across charts too.
#pragma once

#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/error_codes.h"
#include "vgi/bake/images/parameterise.h"

namespace lodestone::vgi {

// A parent's error is at least this many times its child's, one step of the code: a sample that appears can move to its
// place while the wanted error falls by that factor, and is there before the next one appears. 2^(1/8).
inline constexpr double error_ratio = 1.0905077326652577;
// Radii may be smaller the larger the smallest Q that is used: at 720 lines and 60 degrees, errors up to 10 pixels.
inline constexpr double least_magnification = 64;

// Distances of one chart to the source, from the source's vertices and from every sample. Sets the codes of its samples
// to their own errors. Different charts may be measured at once.
struct ChartErrors {
    std::vector<double> levels;  // per level of the atlas: two-sided, object units
    std::vector<double> pages;   // per page of positions: of its level, two-sided, object units
};
ChartErrors measure_samples(Atlas& atlas, uint32_t chart, const Chart& source);

// Once all charts are measured: errors and radii grow until they are saturated, and are shared by glued samples.
void saturate(Atlas& atlas);

// Fills Atlas::bounds. page_errors: per chart, ChartErrors::pages.
void bound_pages(Atlas& atlas, const std::vector<std::vector<double>>& page_errors);

// Glued samples share errors and radii; both are saturated; bounds hold what they say. Fault::invariant names the
// place.
Result<void> validate_errors(const Atlas& atlas);

}  // namespace lodestone::vgi
