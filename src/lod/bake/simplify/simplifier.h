// What turns a mesh into a collapse list.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/progress.h"
#include "lod/bake/simplify/collapse_list.h"

namespace lodestone {

// How far and by which error a mesh is simplified.
struct SimplifyOptions {
    uint64_t target_triangles = 0;  // stop at or below this count; 0 goes as far as it can
    // Weights of attributes against position in the error, dimensionless: an attribute difference of 1 (a unit of
    // normal, a full colour channel, one texture repeat) weighs like `weight` times the bounding-box diagonal / 100.
    double normal_weight = 0.04;  // of normals
    double uv_weight = 0.15;      // of texture coordinates
    double colour_weight = 0.12;  // of vertex colours
    // Extra weight of quadrics that hold boundaries and seams in place.
    double boundary_weight = 10;
    uint64_t seed = 1;  // no simplifier draws random numbers so far
};

// Makes collapse lists. mesh: oriented manifold, as `repair` leaves it.
class Simplifier {
public:
    virtual ~Simplifier() = default;
    virtual std::string name() const = 0;  // for reports
    // Deterministic for any number of threads. Fault::interrupted when progress says stop; Fault::format where the
    // simplifier cannot take the mesh.
    virtual Result<CollapseList> simplify(const TriMesh& mesh, const SimplifyOptions& options,
                                          const Progress& progress = {}) const = 0;
};

// Lodestone's own: quadric error metrics with attributes (quadric_simplifier.cpp), half-edge placement.
std::unique_ptr<Simplifier> make_quadric_simplifier();
// OpenMesh's decimater with its ModQuadric (openmesh_simplifier.cpp): positions alone count.
std::unique_ptr<Simplifier> make_openmesh_simplifier();

}  // namespace lodestone
