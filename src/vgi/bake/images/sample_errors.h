// Errors for the cuts: of every sample, what leaving it out costs and from how far away that matters; of every page,
// what drawing it as a grid costs, and where it lies and looks.
//
//   Blow, "Terrain rendering at high levels of detail", GDC 2000, for spheres around samples; Pajarola, "Large scale
//   terrain visualization using the restricted quadtree triangulation", IEEE Visualization 1998, for saturation;
//   Lindstrom, Pascucci, "Visualization of large terrains made easy", IEEE Visualization 2001, for both.
//
// What a cut makes of them: saturation.h.
#pragma once

#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/sample_depths.h"
#include "vgi/asset/saturation.h"
#include "vgi/bake/images/parameterise.h"

namespace lodestone::vgi {

// Distances of one chart to the source, from the source's vertices and from every sample of its own. Sets the codes of
// its samples to their own errors, and those of samples that are not there. Different charts may be measured at once.
struct ChartErrors {
    std::vector<double> levels;  // per level of the atlas: two-sided, object units
    std::vector<double> pages;   // per page of positions: of its level, two-sided, object units
};
ChartErrors measure_samples(Atlas& atlas, const SampleDepths& depths, uint32_t chart, const Chart& source);

// Once all charts are measured: errors and radii grow until they are saturated, and are shared by glued samples.
void saturate(Atlas& atlas);

// Fills Atlas::bounds. page_errors: per chart, ChartErrors::pages.
void bound_pages(Atlas& atlas, const std::vector<std::vector<double>>& page_errors);

}  // namespace lodestone::vgi
