// What a mesh is as a surface: neighbours across edges, components, boundary loops, genus. Read through vertices, so
// attribute seams do not count as boundary.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Counts of a mesh. Field names are those of `input` in the bake report (docs/cli.md), where it has them.
struct Topology {
    uint64_t triangles = 0, vertices = 0;  // vertices: those that triangles use
    uint64_t edges = 0;                    // each once, however many triangles it has
    uint64_t components = 0;               // connected through shared vertices
    uint64_t boundary_edges = 0;           // edges with one triangle
    uint64_t boundary_loops =
        0;  // closed chains of boundary edges; where the boundary touches itself, by connected pieces
    uint64_t non_manifold_edges = 0;     // edges with more than two triangles
    uint64_t non_manifold_vertices = 0;  // their triangles form more than one fan
    uint64_t inconsistent_edges = 0;     // two triangles that run the same way along the edge
    int64_t genus = 0;                   // sum over components with holes filled; -1 where not an oriented manifold
    uint64_t seam_edges = 0;             // inner edges whose two triangles use different wedges
    // Whether every edge has at most two triangles and every vertex one fan.
    bool manifold() const { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
    // Whether every edge has two triangles or more.
    bool closed() const { return boundary_edges == 0; }
};
// Counts what the mesh is. It must be valid (TriMesh::validate); it need not be manifold.
Topology topology_of(const TriMesh& mesh);

inline constexpr uint32_t no_neighbour = ~0u;  // no half-edge on the other side

// Corners of triangle t are numbered 3 t + k, k = 0 .. 2, and so are the half-edges that begin there. This is the
// corner behind, in the same triangle.
inline uint32_t next_corner(uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
// The corner before, in the same triangle.
inline uint32_t previous_corner(uint32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

// Per half-edge, the one on the other side, which runs the other way; no_neighbour on the boundary. corner_vertex: per
// corner, each below `vertices`. manifold, if given: set to false where an edge has more than two triangles, of which
// the first two are then paired.
std::vector<uint32_t> half_edge_twins(std::span<const uint32_t> corner_vertex, size_t vertices,
                                      bool* manifold = nullptr);

// Component number of each triangle, in order of first appearance; connected through shared vertices.
std::vector<uint32_t> components_of(const TriMesh& mesh, uint32_t* count = nullptr);

}  // namespace lodestone
