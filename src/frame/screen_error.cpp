#include "frame/screen_error.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "base/check.h"

namespace lodestone {

Sphere bounding_sphere_of(std::span<const glm::vec3> points) {
    if (points.empty()) return {};
    glm::vec3 low = points[0], high = low;
    for (const glm::vec3& p : points) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    Sphere sphere{(low + high) * 0.5f, 0};
    for (const glm::vec3& p : points) sphere.radius = std::max(sphere.radius, glm::distance(sphere.centre, p));
    sphere.radius *= 1.00001f;  // no point outside for rounding
    return sphere;
}

float largest_scale(const glm::mat4& object_to_world) {
    // The root of the largest eigenvalue of M^T M, rounded up.
    const glm::dvec3 x(object_to_world[0]), y(object_to_world[1]), z(object_to_world[2]);
    const double xx = glm::dot(x, x), yy = glm::dot(y, y), zz = glm::dot(z, z);
    const double xy = glm::dot(x, y), yz = glm::dot(y, z), zx = glm::dot(z, x);
    // It is no less than any of the diagonal and no more than any row (S. Gershgorin 1931): all there is to find out of
    // axes that are square to each other, as rotations leave them.
    const double least = std::max({xx, yy, zz});
    const double most = std::max(
        {xx + std::abs(xy) + std::abs(zx), yy + std::abs(xy) + std::abs(yz), zz + std::abs(yz) + std::abs(zx)});
    if (most - least <= 2e-6 * least) return static_cast<float>(std::sqrt(most)) * 1.00001f;
    // O. K. Smith, Eigenvalues of a symmetric 3 x 3 matrix, CACM 1961.
    const double mean = (xx + yy + zz) / 3;
    const glm::dvec3 off(xx - mean, yy - mean, zz - mean);
    const double spread = std::sqrt((glm::dot(off, off) + 2 * (xy * xy + yz * yz + zx * zx)) / 6);
    const glm::dmat3 deviation(off.x, xy, zx, xy, off.y, yz, zx, yz, off.z);
    const double cosine = std::clamp(glm::determinant(deviation / spread) / 2, -1.0, 1.0);
    const double largest = mean + 2 * spread * std::cos(std::acos(cosine) / 3);
    return static_cast<float>(std::sqrt(largest)) * 1.00001f;
}

Sphere to_world(const Sphere& object_sphere, const glm::mat4& object_to_world) {
    const glm::vec4 centre = object_to_world * glm::vec4(object_sphere.centre, 1);
    return {glm::vec3(centre), object_sphere.radius * largest_scale(object_to_world)};
}

double error_under(const View& view, const Sphere& object_sphere, const glm::mat4& object_to_world,
                   double pixel_error) {
    LODE_CHECK(view.focal_px > 0 && pixel_error > 0, view.focal_px, pixel_error);
    const Sphere sphere = to_world(object_sphere, object_to_world);
    const double distance = std::max<double>(glm::distance(sphere.centre, view.eye) - sphere.radius, view.near_plane);
    const double scale = largest_scale(object_to_world);
    return scale > 0 ? pixel_error * distance / view.focal_px / scale : 0;
}

}  // namespace lodestone
