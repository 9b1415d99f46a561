// Wedges of a mesh as the vertices that GPUs read, and back.
// Octahedral normals: Cigolle et al., "A survey of efficient representations for independent unit vectors", JCGT 2014.
#pragma once

#include <span>
#include <vector>

#include "mesh/tri_mesh.h"
#include "shaders/shared/mesh_vertex.h"

namespace lodestone {

// One vertex per wedge, in wedge order. Missing attributes become: normal from the geometry (compute_normals), texture
// coordinate (0, 0), colour white, material 0. Second texture coordinates lie beside vertices, not in them.
std::vector<MeshVertex> pack_vertices(const TriMesh& mesh);

// The attributes of `mesh` that pack_vertices would have to invent.
struct PresentAttributes {
    bool normals = false, uvs = false, colours = false, materials = false;  // whether the mesh has them
    bool second_uvs = false, tangents = false;                              // likewise; never of an atlas
    bool operator==(const PresentAttributes&) const = default;
};
// Which arrays of the mesh are not empty.
PresentAttributes attributes_of(const TriMesh& mesh);

// Positions come from the first wedge of each vertex; wedge_vertex[w] < number of vertices. Normals are within 0.005
// degrees of those packed; everything else is exact. Second texture coordinates, materials and images are the caller's
// to fill in.
TriMesh unpack_vertices(std::span<const MeshVertex> wedges, std::span<const uint32_t> wedge_vertex,
                        const PresentAttributes& present);

// Octahedral coordinates in steps of 1 / 32767; (0, 0) of a vector of length 0.
std::array<int16_t, 2> pack_normal(const glm::vec3& unit);
// The unit vector that pack_normal() packed.
glm::vec3 unpack_normal(const std::array<int16_t, 2>& packed);

}  // namespace lodestone
