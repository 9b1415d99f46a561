#include "mesh/distance/distance.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

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

struct Sums {
    double squares = 0, largest = 0;
};

// Distances of the points to the surface; chunks are summed in order, so that the number of threads changes nothing.
Sums distances(const std::vector<glm::dvec3>& points, const ClosestSurface& surface) {
    constexpr size_t chunk = 2048;
    const size_t count = points.size();
    std::vector<Sums> chunks((count + chunk - 1) / chunk);
    parallel_for(count, chunk, [&](size_t begin, size_t end) {
        Sums sums;
        uint32_t hint = ClosestSurface::no_hint;
        for (size_t i = begin; i < end; ++i) {
            const auto hit = surface.closest(points[i], hint);
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

// The largest distance of the points, if it is more than `at_least`. resolution: what is nearer counts as touching.
double farthest(const std::vector<glm::dvec3>& points, const ClosestSurface& surface, double at_least,
                double resolution) {
    constexpr size_t chunk = 2048;
    std::vector<double> chunks((points.size() + chunk - 1) / chunk);
    parallel_for(points.size(), chunk, [&](size_t begin, size_t end) {
        double largest = at_least;
        uint32_t hint = ClosestSurface::no_hint;
        for (size_t i = begin; i < end; ++i) {
            const auto hit = surface.closest(points[i], hint, std::max(largest, resolution));
            hint = hit.triangle;
            if (hit.distance > resolution) largest = std::max(largest, hit.distance);
        }
        chunks[begin / chunk] = largest;
    });
    for (const double largest : chunks) at_least = std::max(at_least, largest);
    return at_least;
}

// Vertices along the triangles, so that one is near the next; every n-th where there are more than `most`.
std::vector<glm::dvec3> some_vertices(const TriMesh& mesh, size_t most) {
    std::vector<uint32_t> order;
    std::vector<bool> seen(mesh.vertex_count(), false);
    for (const Triangle& t : mesh.triangles) {
        for (const uint32_t w : t) {
            const uint32_t v = mesh.wedge_vertex[w];
            if (!seen[v]) order.push_back(v);
            seen[v] = true;
        }
    }
    std::vector<glm::dvec3> points(std::min(most, order.size()));
    for (size_t i = 0; i < points.size(); ++i) points[i] = mesh.positions[order[i * order.size() / points.size()]];
    return points;
}

// Of all vertices that a triangle has.
std::vector<glm::vec3> corner_positions(const TriMesh& mesh) {
    const std::vector<glm::dvec3> all = some_vertices(mesh, mesh.vertex_count());
    return {all.begin(), all.end()};
}

std::vector<glm::dvec3> area_samples(const TriMesh& mesh, size_t count, uint64_t seed) {
    std::vector<glm::dvec3> places;
    for (const SurfacePoint& p : points_by_area(mesh, count, seed)) places.push_back(p.place);
    return places;
}

}  // namespace

std::vector<SurfacePoint> points_by_area(const TriMesh& mesh, size_t count, uint64_t seed) {
    std::vector<double> sums(mesh.triangle_count());
    double total = 0;
    for (size_t t = 0; t < sums.size(); ++t) {
        const glm::dvec3 a = mesh.position_of(t, 0), b = mesh.position_of(t, 1), c = mesh.position_of(t, 2);
        total += glm::length(glm::cross(b - a, c - a));
        sums[t] = total;
    }
    std::vector<SurfacePoint> points;
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
        points[i] = {a + (b - a) * u + (c - a) * v, static_cast<uint32_t>(t)};
    }
    return points;
}

double resolution_of(const TriMesh& mesh) {
    const Box box = bounding_box(mesh.positions);
    double largest = 0;
    for (int k = 0; k < 3; ++k)
        largest = std::max({largest, std::abs(double{box.low[k]}), std::abs(double{box.high[k]})});
    return largest * double{std::numeric_limits<float>::epsilon()};
}

MeasuredSurface::MeasuredSurface(const TriMesh& mesh, const DistanceOptions& options)
    : samples_(area_samples(mesh, options.samples, options.seed)),
      vertices_(some_vertices(mesh, options.vertices)),
      positions_(corner_positions(mesh)),
      places_(positions_),
      surface_(mesh.positions, vertex_indices(mesh)),
      resolution_(resolution_of(mesh)) {}
MeasuredSurface::~MeasuredSurface() = default;
MeasuredSurface::MeasuredSurface(MeasuredSurface&&) noexcept = default;

SurfaceDistance MeasuredSurface::to(const MeasuredSurface& other) const {
    const Sums area = distances(samples_, other.surface_), corners = distances(vertices_, other.surface_);
    SurfaceDistance result;
    result.rms = samples_.empty() ? 0 : std::sqrt(area.squares / static_cast<double>(samples_.size()));
    result.max = std::max(area.largest, corners.largest);
    return result;
}

double MeasuredSurface::farthest_from(const MeasuredSurface& other, double at_least) const {
    const double resolution = std::max(resolution_, other.resolution_);
    // Levels keep vertices of their source: what is a vertex of both needs no search.
    std::vector<glm::dvec3> own;
    for (const glm::dvec3& v : vertices_) {
        if (other.places_.find(glm::vec3(v)) == PositionIndex::nowhere) own.push_back(v);
    }
    return farthest(own, other.surface_, farthest(samples_, other.surface_, at_least, resolution), resolution);
}

TwoSidedDistance surface_distance(const TriMesh& a, const TriMesh& b, const DistanceOptions& options) {
    LODE_CHECK(a.triangle_count() > 0 && b.triangle_count() > 0);
    DistanceOptions other = options;
    other.seed = mix64(options.seed);
    const MeasuredSurface surface_a(a, options), surface_b(b, other);
    return {surface_a.to(surface_b), surface_b.to(surface_a)};
}

}  // namespace lodestone
