// New texture coordinates for a mesh: clusters (charts/clusters.h) laid onto rectangles and packed into squares.
// Nothing overlaps, nothing is turned over, and that is checked exactly. The source's vertices stay where they are;
// triangles are cut only where a straight side of a chart, or the edge of the surface, would flatten them.
#pragma once

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "mesh/tri_mesh.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

struct UnwrapOptions {
    uint32_t charts = 0;         // wanted; 0 for as many as suit the mesh
    double worst_stretch = 3;    // charts that are stretched more are cut finer
    uint32_t most_rounds = 5;    // of that
    uint32_t textures = 1;       // squares
    double gutter = 4.0 / 4096;  // between charts, in sides of a square
};

// Field names are those of the report of `unwrap` (docs/cli.md), where it has them.
struct UnwrapReport {
    uint32_t charts = 0, rounds = 0;
    uint64_t source_triangles = 0, triangles = 0, source_vertices = 0, vertices = 0;
    uint64_t seam_edges = 0;                // inner edges whose two triangles lie in different charts
    double seam_length = 0;                 // object units
    double l2_stretch_rms = 0;              // over all squares together, 1 where texels are spread evenly
    double l2_stretch_worst = 0;            // of a chart
    double coverage = 0;                    // of the squares, by triangles
    uint64_t flipped = 0, overlapping = 0;  // triangles; pairs of them
    double cluster_seconds = 0, lay_out_seconds = 0, pack_seconds = 0, check_seconds = 0;
};

// The mesh as it was, with other texture coordinates, and where its triangles come from.
struct Unwrapped {
    TriMesh mesh;                        // without textures; vertices of the source first, as they were
    std::vector<uint32_t> square;        // per triangle
    std::vector<SurfaceTriangle> parts;  // per triangle, `vertices` are of no use: its source triangle, and
    CutPlaces places;                    // where on it it lies
};

// What repair() leaves of a mesh that has triangles. Fault::invariant where a chart cannot be laid out, Fault::usage
// where gutters leave no room.
Result<Unwrapped> unwrap(const TriMesh& mesh, const UnwrapOptions& options, UnwrapReport& report,
                         const Progress& progress = {});

}  // namespace lodestone::vgi
