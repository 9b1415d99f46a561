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
    // The root of the largest eigenvalue of M^T M (O. K. Smith, Eigenvalues of a symmetric 3 x 3 matrix, CACM 1961),
    // rounded up.
    const glm::dmat3 m(object_to_world);
    const glm::dmat3 square = glm::transpose(m) * m;
    const double mean = (square[0][0] + square[1][1] + square[2][2]) / 3;
    const glm::dmat3 deviation = square - glm::dmat3(mean);
    double spread = 0;
    for (int k = 0; k < 3; ++k) spread += glm::dot(deviation[k], deviation[k]);
    spread = std::sqrt(spread / 6);
    if (spread <= 1e-9 * mean) return static_cast<float>(std::sqrt(mean)) * 1.00001f;
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
