// What our simplifier is measured against, and on what.
#pragma once

#include <string>
#include <vector>

#include "lod/bake/simplify/collapse_list.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

struct Subject {
    std::string name;
    TriMesh mesh;  // repaired
};
// The scans, where they are; a generated rock besides. Says on stderr what is missing.
std::vector<Subject> simplification_subjects();

// The mesh after the first collapses of a list, as many as leave at most `triangles`. Positions alone.
TriMesh shape_after(const TriMesh& mesh, const CollapseList& list, size_t triangles);

// OpenMesh's decimater with ModQuadric alone, half-edge collapses; positions alone. cpu_seconds, if given: of
// decimation without building the mesh.
TriMesh openmesh_decimated(const TriMesh& mesh, size_t triangles, double* cpu_seconds = nullptr);

// meshoptimizer's simplifier; positions alone.
TriMesh meshoptimizer_simplified(const TriMesh& mesh, size_t triangles, double* cpu_seconds = nullptr);

}  // namespace lodestone
