// Stage 6 of the atlas: a quad is laid onto the unit square. Sides lie on the square's by arc length, the inside is
// harmonic with positive weights, so nothing folds; then the weights are changed, triangle by triangle, until sampling
// is even: after Yoshizawa, Belyaev, Seidel, "A fast and simple stretch-minimizing mesh parameterization", SMI 2004,
// with a density per triangle instead of per edge. Stretch: Sander, Snyder, Gortler, Hoppe, "Texture mapping
// progressive meshes", SIGGRAPH 2001.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

// A quad with its vertices laid onto the unit square: ChartMesh::flat, corner 0 at (0, 0), then counter-clockwise.
struct Chart {
    ChartMesh patch;           // the quad, laid out
    double area = 0;           // of the surface
    double stretch = 0;        // L2, 1 where sampling is perfectly even
    double tutte_stretch = 0;  // before the weights were changed
    uint32_t solves = 0;       // linear systems solved
    bool uniform = false;      // equal weights, because no other was free of folds
};

// How evenly, and with how much work.
struct ParameteriseOptions {
    uint32_t most_solves = 12;  // of a chart
    double least_gain = 0.002;  // of the stretch, in a round; else it ends
    // Samples lie denser by curvature to this power, relative to the chart's mean, up to twice and down to half of what
    // they were along each direction. 0: evenly. Errors of what is interpolated linearly are even at 0.5.
    double curvature_importance = 0.15;
    // Vertices of the sides are placed along them as is best, not by arc length: for charts that share no samples.
    bool sliding_sides = false;
};

// Lays a quad of the surface onto the unit square.
// triangles: those of the quad. sides: its four in order, arcs as traced on the same surface. Fault::invariant where
// even equal weights fold.
Result<Chart> parameterise(const Surface& surface, std::span<const uint32_t> triangles, std::span<const Side> sides,
                           const std::vector<Arc>& arcs, const ParameteriseOptions& options = {});

// Squared L2 stretch of a triangle that lies at flat positions with twice the area `flat_area`, > 0: the mean of the
// squared lengths that unit vectors of the plane have on the surface.
double squared_stretch(const ChartMesh& patch, uint32_t triangle);
// Over the whole patch, which covers the unit square: sqrt(sum of area * squared stretch) / sum of area.
double l2_stretch(const ChartMesh& patch);

}  // namespace lodestone::vgi
