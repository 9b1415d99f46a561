// A mesh of fewer triangles, for programs that want no asset.
#pragma once

#include <cstdint>
#include <string>

#include "base/progress.h"
#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// How far a mesh is simplified; exactly one of the two is above 0.
struct SimplifyTarget {
    uint64_t triangles = 0;  // at most so many, or as few as topology allows
    double error = 0;        // object units: the coarsest level within this two-sided distance of the source
    std::string simplifier = "quadric";  // quadric, openmesh
};

// The mesh is repaired first. Fault::usage where the target makes no sense, Fault::interrupted.
Result<TriMesh> simplify(TriMesh mesh, const SimplifyTarget& target, const Progress& progress = {});

}  // namespace lodestone
