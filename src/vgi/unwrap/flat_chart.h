// A cluster of a surface laid onto a rectangle: first step of unwrapping. Borders follow edges of the mesh, so that
// nothing is cut there; sides are straight and the inside is harmonic (images/parameterise.h), so nothing folds.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/bake/charts/chart_mesh.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

// A chart laid onto the unit square, or, where its border has three vertices, onto a triangle in it: ChartMesh::flat.
struct FlatChart {
    ChartMesh patch;
    double area = 0;     // of the surface, object units squared
    double along_x = 0;  // integral over the surface of the squared length that a step along x of the square has on it
    double along_y = 0;  // of one along y
    double filled = 1;   // share of the square that it covers

    // L2 stretch (Sander, Snyder, Gortler, Hoppe, "Texture mapping progressive meshes", SIGGRAPH 2001) when the square
    // is drawn as wide and high as this, both > 0; 1 where it is even.
    double stretch(double width, double height) const;
    // The width for a height of 1 at which that is least.
    double best_aspect() const;
    double best_stretch() const { return stretch(best_aspect(), 1); }  // at that width
};

// triangles: of the surface, a disk. Fault::invariant where even equal weights fold it.
Result<FlatChart> lay_flat(const Surface& surface, std::span<const uint32_t> triangles);
// The same with equal weights of edges: more stretch, and no triangle is small.
void lay_evenly(FlatChart& chart);

// The surface of a mesh, without the triangles that have no neighbours, and with every inner edge between two boundary
// vertices split (make_clusters asks for it). chords: how many were.
struct JoinedSurface {
    Surface surface;
    std::vector<uint32_t> lone;  // triangles of the mesh
    uint32_t chords = 0;
};
JoinedSurface joined_surface(const TriMesh& mesh);

// Gives a triangle that has two edges on the border to one other cluster to that cluster, as long as there are any:
// straight sides would have to cut it. Clusters stay disks. twins: of the surface. Returns how many.
uint32_t smooth_borders(std::span<const uint32_t> twins, std::vector<uint32_t>& label);

}  // namespace lodestone::vgi
