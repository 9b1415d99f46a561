// A mesh cut along planes, so that the pieces either side of a plane have the very same vertices where they meet.
//
// Where a plane cuts an edge or a triangle follows from that edge or triangle and the planes alone, whichever side is
// kept. So pieces fit that are cut by different calls, as long as the same planes cut what they have in common.
//
//   Sutherland, Hodgman, "Reentrant polygon clipping", Communications of the ACM 17, 1974, for each triangle.
#pragma once

#include <glm/vec3.hpp>
#include <span>

#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// A plane and the side of it that is kept. Two pieces beside a plane have it with the same numbers but for `above`.
struct ClipPlane {
    glm::dvec3 normal{1, 0, 0};
    double offset = 0;   // what lies on it has dot(normal, point) == offset; object units where the normal has length 1
    bool above = false;  // kept is where that is larger, else where it is smaller; what lies in the plane is below
    bool operator==(const ClipPlane&) const = default;

    // Above 0 above the plane, below 0 below it.
    double height(const glm::vec3& point) const {
        return normal.x * double{point.x} + normal.y * double{point.y} + normal.z * double{point.z} - offset;
    }
};

// What all of the planes keep. The mesh is repaired first, as pieces of what is no oriented manifold need not fit.
// Attributes are interpolated along the edges that are cut. Fault::format where nothing is left, or as repair().
Result<void> clip(TriMesh& mesh, std::span<const ClipPlane> planes);

// Whether an edge lies on a plane, but for the rounding of its ends. largest: no coordinate of the mesh is farther from
// 0.
bool lies_on(const ClipPlane& plane, const glm::vec3& a, const glm::vec3& b, double largest);

}  // namespace lodestone
