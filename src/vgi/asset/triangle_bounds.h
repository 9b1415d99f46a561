// The sphere and the cone of normals of some triangles, by which views are told whether they see them.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>

#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

using TriangleCorners = std::array<glm::dvec3, 3>;  // counter-clockwise seen from outside

// Centre and radius. further: what the radius has beyond the triangles.
void put_sphere(std::span<const TriangleCorners> triangles, double further, PageBounds& bounds);
// Axis and cosine; none where normals are more than a right angle from their mean. triangles: places as they are, or on
// a lattice, where normals are the same and flat triangles have none. turned: radians by which the cone is wider.
void put_cone(std::span<const TriangleCorners> triangles, double turned, PageBounds& bounds);

}  // namespace lodestone::vgi
