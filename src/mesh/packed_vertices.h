// Wedges of a mesh as the vertices that GPUs read, and back.
// Octahedral normals: Cigolle et al., "A survey of efficient representations for independent unit vectors", JCGT 2014.
#pragma once

#include <span>
#include <vector>

#include "mesh/tri_mesh.h"
#include "shaders/shared/mesh_vertex.h"

namespace lodestone {

// One vertex per wedge, in wedge order. Missing attributes become: normal from the geometry (compute_normals), texture
// coordinate (0, 0), colour white, material 0.
std::vector<MeshVertex> pack_vertices(const TriMesh& mesh);
// What lies beside them, in the same order; empty where the mesh has neither second texture coordinates nor tangents.
std::vector<FurtherAttributes> pack_further(const TriMesh& mesh);

// The attributes of `mesh` that pack_vertices would have to invent.
struct PresentAttributes {
    bool normals = false, uvs = false, colours = false, materials = false;  // whether the mesh has them
    bool second_uvs = false, tangents = false;                              // likewise; never of an atlas
    bool further() const { return second_uvs || tangents; }                 // whether something lies beside vertices
    bool operator==(const PresentAttributes&) const = default;
};
// Which arrays of the mesh are not empty.
PresentAttributes attributes_of(const TriMesh& mesh);

// Positions come from the first wedge of each vertex; wedge_vertex[w] < number of vertices. Normals are within 0.005
// degrees of those packed, tangents within 0.01; everything else is exact. further: as many as wedges, or none where
// there is nothing beside them. Materials and images are the caller's to fill in.
TriMesh unpack_vertices(std::span<const MeshVertex> wedges, std::span<const FurtherAttributes> further,
                        std::span<const uint32_t> wedge_vertex, const PresentAttributes& present);

// Octahedral coordinates in steps of 1 / 32767; (0, 0) of a vector of length 0.
std::array<int16_t, 2> pack_normal(const glm::vec3& unit);
// The unit vector that pack_normal() packed.
glm::vec3 unpack_normal(const std::array<int16_t, 2>& packed);

// A tangent as TriMesh has it, as a word (shaders/shared/mesh_vertex.h); 0 where there is none.
uint32_t pack_tangent(const glm::vec4& tangent);
// The tangent that pack_tangent() packed. Any word is one, or none.
glm::vec4 unpack_tangent(uint32_t word);

}  // namespace lodestone
