#include "mesh/distance.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "base/random.h"
#include "base/threads.h"

namespace lodestone {

namespace {

std::vector<uint32_t> vertex_indices(const TriMesh& mesh) {
    std::vector<uint32_t> indices;
    indices.reserve(mesh.triangle_count() * 3);
    for (const Triangle& t : mesh.triangles) {
        for (const uint32_t w : t) indices.push_back(mesh.wedge_vertex[w]);
    }
    return indices;
}

// Points of the surface, near ones near each other in the list: stratified over the area, triangle after triangle.
std::vector<glm::dvec3> area_samples(const TriMesh& mesh, size_t count, uint64_t seed) {
    std::vector<double> sums(mesh.triangle_count());
    double total = 0;
    for (size_t t = 0; t < sums.size(); ++t) {
        const glm::dvec3 a = mesh.position_of(t, 0), b = mesh.position_of(t, 1), c = mesh.position_of(t, 2);
        total += glm::length(glm::cross(b - a, c - a));
        sums[t] = total;
    }
    std::vector<glm::dvec3> points;
    if (total <= 0) return points;
    points.resize(count);
    for (size_t i = 0; i < count; ++i) {
        Random random(mix64(seed) + i * 0x9e3779b97f4a7c15ULL);
        const double where = (static_cast<double>(i) + random.unit()) / static_cast<double>(count) * total;
        const size_t t = std::min<size_t>(
            static_cast<size_t>(std::upper_bound(sums.begin(), sums.end(), where) - sums.begin()), sums.size() - 1);
        double u = random.unit(), v = random.unit();
        if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
        }
        const glm::dvec3 a = mesh.position_of(t, 0), b = mesh.position_of(t, 1), c = mesh.position_of(t, 2);
        points[i] = a + (b - a) * u + (c - a) * v;
    }
    return points;
}

struct Sums {
    double squares = 0, largest = 0;
};

// Distances of the points to the surface; chunks are summed in order, so that the number of threads changes nothing.
template <class Point>
Sums distances(size_t count, const ClosestSurface& surface, const Point& point) {
    constexpr size_t chunk = 2048;
    std::vector<Sums> chunks((count + chunk - 1) / chunk);
    parallel_for(count, chunk, [&](size_t begin, size_t end) {
        Sums sums;
        uint32_t hint = ClosestSurface::no_hint;
        for (size_t i = begin; i < end; ++i) {
            const auto hit = surface.closest(point(i), hint);
            hint = hit.triangle;
            sums.squares += hit.distance * hit.distance;
            sums.largest = std::max(sums.largest, hit.distance);
        }
        chunks[begin / chunk] = sums;
    });
    Sums all;
    for (const Sums& s : chunks) {
        all.squares += s.squares;
        all.largest = std::max(all.largest, s.largest);
    }
    return all;
}

SurfaceDistance one_sided(const TriMesh& from, const ClosestSurface& to, const DistanceOptions& options,
                          uint64_t seed) {
    const auto samples = area_samples(from, options.samples, seed);
    const Sums area = distances(samples.size(), to, [&](size_t i) { return samples[i]; });
    // Vertices are visited along the triangles, so that one is near the next.
    std::vector<uint32_t> order;
    std::vector<bool> seen(from.vertex_count(), false);
    for (const Triangle& t : from.triangles) {
        for (const uint32_t w : t) {
            const uint32_t v = from.wedge_vertex[w];
            if (!seen[v]) order.push_back(v);
            seen[v] = true;
        }
    }
    const Sums vertices = distances(order.size(), to, [&](size_t i) { return glm::dvec3(from.positions[order[i]]); });
    SurfaceDistance result;
    result.rms = samples.empty() ? 0 : std::sqrt(area.squares / static_cast<double>(samples.size()));
    result.max = std::max(area.largest, vertices.largest);
    return result;
}

}  // namespace

TwoSidedDistance surface_distance(const TriMesh& a, const TriMesh& b, const DistanceOptions& options) {
    LODE_CHECK(a.triangle_count() > 0 && b.triangle_count() > 0);
    const ClosestSurface surface_a(a.positions, vertex_indices(a)), surface_b(b.positions, vertex_indices(b));
    return {one_sided(a, surface_b, options, options.seed * 2), one_sided(b, surface_a, options, options.seed * 2 + 1)};
}

}  // namespace lodestone
