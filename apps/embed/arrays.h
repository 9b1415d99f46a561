// Meshes as arrays of the program that embeds Lodestone, which may hold anything.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Vertices as they are drawn: several at one position where an attribute jumps.
struct MeshArrays {
    std::span<const glm::vec3> positions;
    std::span<const Triangle> triangles;
    std::span<const glm::vec3> normals;    // empty or one per vertex, of any length
    std::span<const glm::vec2> uvs;        // empty or one per vertex
    std::span<const glm::u8vec4> colours;  // empty or one per vertex
    std::span<const uint16_t> materials;   // empty or one per vertex
    std::vector<Material> material_table;  // what materials refer to
    std::vector<Image> images;             // what the table refers to
};

// A mesh of one wedge per vertex. Fault::usage names the first number that is wrong, and its place.
Result<TriMesh> mesh_of(MeshArrays arrays);

// Per wedge: where it is. Of a mesh without seams the mesh's own positions; else a copy in `room`.
std::span<const glm::vec3> wedge_positions(const TriMesh& mesh, std::vector<glm::vec3>& room);

}  // namespace lodestone
