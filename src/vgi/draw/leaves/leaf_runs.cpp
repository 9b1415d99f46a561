#include "vgi/draw/leaves/leaf_runs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <span>

namespace lodestone::vgi {

namespace {

using Corners = std::array<glm::dvec3, 3>;

glm::dvec3 area_of(const Corners& t) { return glm::cross(t[1] - t[0], t[2] - t[0]); }

void put_sphere(const Atlas& about, std::span<const Corners> triangles, PageBounds& bounds) {
    glm::dvec3 low(std::numeric_limits<double>::max()), high(std::numeric_limits<double>::lowest());
    for (const Corners& corners : triangles) {
        for (const glm::dvec3& p : corners) {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
    }
    bounds.centre = glm::vec3((low + high) * 0.5);
    double radius = 0;
    for (const Corners& corners : triangles) {
        for (const glm::dvec3& p : corners) radius = std::max(radius, glm::distance(p, glm::dvec3(bounds.centre)));
    }
    // Rounded up by what single precision loses of places.
    bounds.radius = static_cast<float>(radius * 1.00001 + about.extent() * 1e-6);
}

// triangles: on the lattice, where normals are the same and flat ones have none.
void put_cone(std::span<const Corners> triangles, PageBounds& bounds) {
    glm::dvec3 sum(0);
    for (const Corners& corners : triangles) sum += area_of(corners);
    if (glm::length(sum) == 0) return;
    const glm::dvec3 rounded = glm::round(glm::normalize(sum) * 127.0), axis = glm::normalize(rounded);
    double cosine = 1;
    for (const Corners& corners : triangles) {
        const glm::dvec3 normal = area_of(corners);
        if (normal != glm::dvec3(0)) cosine = std::min(cosine, glm::dot(glm::normalize(normal), axis));
    }
    if (cosine <= 0) return;
    for (int k = 0; k < 3; ++k) bounds.axis[static_cast<size_t>(k)] = static_cast<int8_t>(rounded[k]);
    bounds.cosine = static_cast<int8_t>(std::floor(cosine * 127 - 1e-9));
}

}  // namespace

std::vector<PageBounds> leaf_runs(const Atlas& about, const LeafPart& part) {
    std::vector<PageBounds> runs;
    runs.reserve((part.triangles.size() + leaf_run_triangles - 1) / leaf_run_triangles);
    std::vector<Corners> places, lattice;
    for (const auto& triangle : part.triangles) {
        Corners &place = places.emplace_back(), &point = lattice.emplace_back();
        for (size_t k = 0; k < 3; ++k) {
            const auto& p = part.vertices[triangle[k]].position;
            place[k] = about.leaf_point(p);
            point[k] = {p[0], p[1], p[2]};
        }
        if (places.size() < leaf_run_triangles && &triangle != &part.triangles.back()) continue;
        put_sphere(about, places, runs.emplace_back());
        put_cone(lattice, runs.back());
        places.clear();
        lattice.clear();
    }
    return runs;
}

}  // namespace lodestone::vgi
