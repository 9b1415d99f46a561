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
    // Power iteration on M^T M; 24 steps from the longest column are ample for a bound that is then rounded up.
    const glm::mat3 m(object_to_world);
    const glm::mat3 square = glm::transpose(m) * m;
    glm::vec3 v(1, 1, 1);
    float longest = 0;
    for (int k = 0; k < 3; ++k) {
        const float length = glm::dot(m[k], m[k]);
        if (length > longest) {
            longest = length;
            v = glm::vec3(0.1f);
            v[k] = 1;
        }
    }
    for (int step = 0; step < 24; ++step) {
        const glm::vec3 next = square * v;
        const float length = glm::length(next);
        if (length == 0) return 0;
        v = next / length;
    }
    return std::sqrt(std::max(longest, glm::length(square * v))) * 1.00001f;
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
