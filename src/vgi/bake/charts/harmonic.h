// Harmonic functions on a patch with positive weights: with a convex boundary they flatten it without folds.
// Tutte, "How to draw a graph", 1963; Floater, "One-to-one piecewise linear mappings over triangulations", 2003.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <span>
#include <vector>

#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

// Solves for the plane positions of inner vertices, those of boundary vertices being given in patch.flat. Made once for
// a patch, solved for as many weights as wanted: the order of elimination stays.
class HarmonicSolver {
public:
    // What boundary vertices may do.
    enum class Border {
        pinned,  // nothing
        // Those that patch.flat has on a side of the unit square, when the solver is made, move along it, but for its
        // corners. Nothing folds then, either: reflected at its sides the patch is a torus (Gortler, Gotsman,
        // Thurston, "Discrete one-forms on meshes and applications to 3D mesh parameterization", 2006).
        sliding,
    };
    // The patch must outlive the solver and keep its triangles.
    explicit HarmonicSolver(ChartMesh& patch, Border border = Border::pinned);
    ~HarmonicSolver();
    HarmonicSolver(const HarmonicSolver&) = delete;
    HarmonicSolver& operator=(const HarmonicSolver&) = delete;

    // density: a factor per triangle, or empty for 1. uniform: every edge weighs the same (then density is not used).
    // False where the system cannot be solved.
    bool solve(std::span<const double> density, bool uniform = false);

private:
    struct System;
    std::unique_ptr<System> system_;
};

}  // namespace lodestone::vgi
