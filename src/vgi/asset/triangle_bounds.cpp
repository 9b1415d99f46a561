#include "vgi/asset/triangle_bounds.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace lodestone::vgi {

static glm::dvec3 area_of(const TriangleCorners& t) { return glm::cross(t[1] - t[0], t[2] - t[0]); }

void put_sphere(std::span<const TriangleCorners> triangles, double further, PageBounds& bounds) {
    glm::dvec3 low(std::numeric_limits<double>::max()), high(std::numeric_limits<double>::lowest());
    for (const TriangleCorners& corners : triangles) {
        for (const glm::dvec3& p : corners) {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
    }
    bounds.centre = glm::vec3((low + high) * 0.5);
    double radius = 0;
    for (const TriangleCorners& corners : triangles) {
        for (const glm::dvec3& p : corners) radius = std::max(radius, glm::distance(p, glm::dvec3(bounds.centre)));
    }
    bounds.radius = static_cast<float>(radius * 1.00001 + further);
}

void put_cone(std::span<const TriangleCorners> triangles, double turned, PageBounds& bounds) {
    glm::dvec3 sum(0);
    for (const TriangleCorners& corners : triangles) sum += area_of(corners);
    if (glm::length(sum) == 0) return;
    const glm::dvec3 rounded = glm::round(glm::normalize(sum) * 127.0), axis = glm::normalize(rounded);
    double cosine = 1;
    for (const TriangleCorners& corners : triangles) {
        const glm::dvec3 normal = area_of(corners);
        if (normal != glm::dvec3(0)) cosine = std::min(cosine, glm::dot(glm::normalize(normal), axis));
    }
    if (turned > 0) cosine = std::cos(std::min(std::acos(std::clamp(cosine, -1.0, 1.0)) + turned, 3.0));
    if (cosine <= 0) return;
    for (int k = 0; k < 3; ++k) bounds.axis[static_cast<size_t>(k)] = static_cast<int8_t>(rounded[k]);
    bounds.cosine = static_cast<int8_t>(std::floor(cosine * 127 - 1e-9));
}

}  // namespace lodestone::vgi
