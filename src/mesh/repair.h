// Makes any triangle soup an oriented manifold (with or without boundary), counting every change.
// Source: Gueziec, Taubin, Lazarus, Horn, "Cutting and stitching: converting sets of polygons to manifold surfaces",
// IEEE TVCG 2001, for cutting by fans; pairing triangles around an edge by angle is ours. Seams are kept: what is
// welded are positions; wedges with different attributes stay apart on one vertex.
#pragma once

#include <cstdint>

#include "base/progress.h"
#include "base/result.h"
#include "mesh/limits.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// What is repaired beyond what a manifold needs.
struct RepairOptions {
    bool weld = true;         // vertices with bitwise equal positions (-0 counts as 0) become one
    float weld_distance = 0;  // object units; > 0 also welds vertices closer than this
    Limits limits;            // on triangles, once degenerate and duplicate ones are dropped
    bool orient = true;       // make neighbouring triangles agree, outside out where a component is closed
};

// Counts of what was changed; all zero for a mesh that was clean. Field names are those of `repair` in the bake report
// (docs/cli.md).
struct RepairReport {
    uint64_t welded_vertices = 0;  // vertices merged into another
    uint64_t degenerate_triangles =
        0;  // dropped: a vertex repeated; flat ones with three vertices stay, they close gaps
    uint64_t duplicate_triangles = 0;    // dropped: same three vertices as an earlier one, either way round
    uint64_t flipped_triangles = 0;      // turned round to agree with their neighbours or to face outwards
    uint64_t non_manifold_edges = 0;     // edges with more than two triangles: those that enclose a wedge of the inside
                                         // stay paired, the rest is cut
    uint64_t non_orientable_edges = 0;   // edges cut because no orientation agrees across them (a Moebius strip)
    uint64_t non_manifold_vertices = 0;  // vertices whose triangles formed several fans, split
    uint64_t unreferenced_vertices = 0;  // dropped
    bool changed() const;                // whether anything was
};

// After it, every edge has one or two triangles that run opposite ways along it, every vertex one fan. Deterministic.
// Fault::format when no triangle is left, or more than RepairOptions::limits allow. Fault::interrupted between its
// steps where it is told to stop; then the mesh is of no use.
Result<RepairReport> repair(TriMesh& mesh, const RepairOptions& options = {}, const Progress& progress = {});

}  // namespace lodestone
