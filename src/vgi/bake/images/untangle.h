// Takes folds out of a sampled chart. Nothing is folded in the plane, but where the chart is sheared much, three
// samples may lie in an order that turns the triangle between them over. Such samples move along the surface, each to
// where the smallest of the triangles around it is largest, until all look outwards.
//
//   Freitag, Plassmann, "Local optimization-based simplicial mesh untangling and improvement", International Journal
//   for Numerical Methods in Engineering 49, 2000: areas are linear in a vertex, so its best place is a linear
//   programme.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/bake/images/parameterise.h"

namespace lodestone::vgi {

// Where a sample lies: in which triangle of the chart's patch, by the weights of its corners.
struct SurfaceSample {
    uint32_t triangle = none;
    glm::dvec3 weights{0};
    glm::dvec3 point{0};  // object units; there, but for samples of borders that have given way (borders.h)

    SurfaceSample() = default;
    SurfaceSample(const ChartMesh& patch, uint32_t triangle, const glm::dvec3& weights);
};

struct Untangled {
    std::vector<uint32_t> moved;    // samples, ascending
    uint32_t before = 0, left = 0;  // cells with a triangle that looks inwards
};

// The axis, 1 or -1 along x, y or z, to whose side all triangles of a height field look; none for other meshes.
std::optional<glm::dvec3> height_axis(const TriMesh& mesh);

// places: of all samples of one chart of the atlas, of so many cells to a side, row by row; those inside may be
// changed. lattice: the atlas, whose lattice is taken. A triangle of the finest level looks inwards if its area vector
// does not look to the side of `up`, or, where there is none, to where the triangles that its corners lie in look
// together.
Untangled untangle(const ChartMesh& patch, std::span<SurfaceSample> places, uint32_t cells, const Atlas& lattice,
                   const std::optional<glm::dvec3>& up);

}  // namespace lodestone::vgi
