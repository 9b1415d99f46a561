// Small meshes made of fuzzing bytes: a generated shape that is dented, cut and glued, or a soup on a coarse lattice.
#pragma once

#include <fuzzer/FuzzedDataProvider.h>

#include "fuzz/promise.h"
#include "mesh/tri_mesh.h"

namespace lodestone::fuzz {

// Adds triangles around one vertex and, if it is closed, as many below around another. The mesh has positions alone.
void add_fan(TriMesh& mesh, uint32_t triangles, bool closed, const glm::vec3& middle);

// Valid (TriMesh::validate), of at most a few hundred triangles, and nothing else: not manifold, perhaps flat, perhaps
// with attributes.
TriMesh random_mesh(FuzzedDataProvider& from);

}  // namespace lodestone::fuzz
