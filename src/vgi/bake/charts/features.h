// Edges that borders of charts prefer: creases, and where colours or materials change at once. Inside a chart they
// would be smeared over a sample's width; along a border each chart has its own side of them.
//
// Seams of texture coordinates alone are not among them: shaders tell them within a cell and take the nearer side,
// while borders along them, which cannot be straight, cost more in accuracy all along (on the rock of 3M triangles:
// stretch 1.18 to 1.23, largest error 2.7e-4 to 6.9e-4).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tri_mesh.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

// Edges of a source mesh that are features. Default: none.
class FeatureLines {
public:
    FeatureLines() = default;
    // Where triangles on both sides have different materials, or differ at an end in colour or normal (by more than 25
    // degrees). Without normals, where they meet at more than 60 degrees.
    explicit FeatureLines(const TriMesh& mesh);

    bool empty() const { return pairs_.empty(); }  // whether there are none
    // Whether the edge between two triangles of the source that share one is a feature.
    bool between(uint32_t a, uint32_t b) const;
    // Forgets the features of these triangles of the source.
    void forget(const std::vector<bool>& triangles);
    // The same as between() of an edge of a surface cut out of the source; twin: as Surface::twins.
    bool at(std::span<const SurfaceTriangle> triangles, std::span<const uint32_t> twin, uint32_t half_edge) const {
        return !empty() && twin[half_edge] != none &&
               between(triangles[half_edge / 3].source, triangles[twin[half_edge] / 3].source);
    }

private:
    std::vector<uint64_t> pairs_;  // lower triangle << 32 | higher one, sorted
};

}  // namespace lodestone::vgi
