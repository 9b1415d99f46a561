// What a mesh is as a surface: neighbours across edges, components, boundary loops, genus. Read through vertices, so
// attribute seams do not count as boundary.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Field names are the JSON names of cli.md's `input`.
struct Topology {
    uint64_t triangles = 0, vertices = 0;
    uint64_t edges = 0;
    uint64_t components = 0;      // connected through shared vertices
    uint64_t boundary_edges = 0;  // edges with one triangle
    uint64_t boundary_loops =
        0;  // closed chains of boundary edges; where the boundary touches itself, by connected pieces
    uint64_t non_manifold_edges = 0;  // edges with more than two triangles
    uint64_t non_manifold_vertices = 0;
    uint64_t inconsistent_edges = 0;  // two triangles that run the same way along the edge
    int64_t genus = 0;                // sum over components with holes filled; -1 where not an oriented manifold
    uint64_t seam_edges = 0;          // inner edges whose two triangles use different wedges
    bool manifold() const { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
    bool closed() const { return boundary_edges == 0; }
};
Topology topology_of(const TriMesh& mesh);

inline constexpr uint32_t no_neighbour = ~0u;

// neighbours[3 * t + k]: half-edge 3 * t' + k' on the other side of triangle t's edge from corner k to corner k+1,
// no_neighbour on the boundary. Edges with more than two triangles pair none. Size 3 * triangle_count().
std::vector<uint32_t> half_edge_twins(const TriMesh& mesh);

// Component number of each triangle, in order of first appearance; connected through shared vertices.
std::vector<uint32_t> components_of(const TriMesh& mesh, uint32_t* count = nullptr);

}  // namespace lodestone
