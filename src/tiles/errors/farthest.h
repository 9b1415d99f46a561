// How far a surface is from another at most, in bounds: what is said is never less than what is, and hardly more.
//
//   Tang, Lee, Kim, "Interactive Hausdorff distance computation for general polygonal models", SIGGRAPH 2009, for
//   triangles that are divided while they may hold the farthest point: the distance to one triangle is convex, so over
//   a piece it is largest in a corner.
//
// That says little of a piece that reaches beyond the triangle, however near it is to those around. So a piece is cut
// along the planes that stand on the edges of the triangle which is nearest to its middle: one part lies over that
// triangle, the others are looked at on their own. Only where the middle is over none is it quartered.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "mesh/distance/distance.h"

namespace lodestone::tiles {

// A part of a surface that is measured.
struct SurfacePiece {
    std::array<glm::dvec3, 3> corners;
    double bound = 0;                         // no point of it is farther from the other surface
    uint32_t near = ClosestSurface::no_hint;  // a triangle of the other surface that is likely to be near
};

// What pieces are measured against.
class TargetSurface {
public:
    // indices: three per triangle, at least one.
    TargetSurface(std::vector<glm::vec3> positions, std::vector<uint32_t> indices);
    // The corners of a triangle.
    std::array<glm::dvec3, 3> corners(uint32_t triangle) const;
    // Distance from a point to one triangle.
    double distance(const glm::dvec3& point, uint32_t triangle) const;
    ClosestSurface::Hit closest(const glm::dvec3& point, uint32_t hint) const { return search_.closest(point, hint); }

private:
    std::vector<glm::vec3> positions_;
    std::vector<uint32_t> indices_;
    ClosestSurface search_;
};

inline constexpr double farthest_tolerance = 0.02;

// The larger of at_least and a bound of the distance from the pieces to the target: not less than the largest there
// is, not more than 1 + farthest_tolerance times that and `resolution`. resolution: units of the points, > 0.
double farthest_of(std::vector<SurfacePiece> pieces, const TargetSurface& target, double at_least, double resolution);

}  // namespace lodestone::tiles
