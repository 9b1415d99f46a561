// From pixels to object units and back: how large a geometric error may be to stay under a pixel error.
// Hoppe, "Progressive Meshes", SIGGRAPH 1996, for the idea of a level per view; the projection rule is ours.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "frame/view.h"

namespace lodestone {

// A ball, in whatever space is said.
struct Sphere {
    glm::vec3 centre{0};  // its middle
    float radius = 0;     // >= 0
};

// A sphere around all points, centred in their box; of no points: a point at the origin.
Sphere bounding_sphere_of(std::span<const glm::vec3> points);

// Largest factor by which the matrix lengthens a vector (the spectral norm of its upper 3x3 part).
float largest_scale(const glm::mat4& object_to_world);

// A sphere in world space that contains the object-space sphere.
Sphere to_world(const Sphere& object_sphere, const glm::mat4& object_to_world);

// The largest geometric error, in object units, that projects to at most pixel_error pixels anywhere in the sphere.
//   view         a perspective view (focal_px > 0)
//   pixel_error  pixels, > 0
// Uses the distance from the eye to the sphere's surface, not less than the near plane; underestimates the projection
// towards the corners of wide views by up to 1/cos of the half angle.
double error_under(const View& view, const Sphere& object_sphere, const glm::mat4& object_to_world, double pixel_error);

}  // namespace lodestone
