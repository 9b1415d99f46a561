#include "lod/bake/level_distance.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "lod/asset/cursor.h"
#include "mesh/distance/distance.h"

namespace lodestone {

namespace {

constexpr uint32_t none = ~0u;
constexpr double near_largest = 0.85;  // of the largest distance: points farther than that are looked around
constexpr double far_from_largest = 0.25;  // of it: a face that near to a point is kept without looking at others
constexpr int climb_steps = 6;         // halvings of the grid around them
constexpr double least_grid = 3, most_grid = 256;

std::vector<glm::vec3> positions_of(const ProgressiveMesh& pm) {
    std::vector<glm::vec3> positions;
    positions.reserve(pm.vertices.size());
    for (const MeshVertex& v : pm.vertices) positions.emplace_back(v.position[0], v.position[1], v.position[2]);
    return positions;
}

}  // namespace

LevelDistance::LevelDistance(const ProgressiveMesh& pm, const Options& options)
    : pm_(pm),
      positions_(positions_of(pm)),
      replay_({pm.orders[0].indices.begin(), pm.orders[0].indices.end()}, pm.wedge_vertex),
      source_(positions_, pm.orders[0].indices),
      level_(positions_, pm.orders[0].indices),
      first_point_(pm.full_triangles(), none),
      source_near_(pm.full_triangles()),
      wedges_(pm.wedges_at(0)) {
    const TriMesh mesh = extract_level(pm, 0);
    LODE_CHECK(mesh.triangle_count() == pm.full_triangles(), mesh.triangle_count(), pm.full_triangles());
    resolution_ = resolution_of(mesh);
    for (const SurfacePoint& p : points_by_area(mesh, options.samples, options.seed)) {
        points_.push_back({glm::vec3(p.place), first_point_[p.triangle]});
        first_point_[p.triangle] = static_cast<uint32_t>(points_.size() - 1);
    }
    double area = 0;
    for (uint32_t face = 0; face < pm.full_triangles(); ++face) {
        source_near_[face] = face;
        const glm::dvec3 a = level_.position(face, 0);
        area += glm::length(glm::cross(level_.position(face, 1) - a, level_.position(face, 2) - a)) / 2;
    }
    samples_per_area_ = area > 0 ? static_cast<double>(options.samples) / area : 0;
    spacing_ = std::sqrt(area / static_cast<double>(std::max<uint64_t>(options.samples, 1)));
}

double LevelDistance::ecol() {
    collapse_faces();
    collect_points();
    place_points();
    for (const uint32_t corner : corners_) {
        if (level_.alive(corner / 3)) look_from(corner);
    }
    return largest_;
}

void LevelDistance::collapse_faces() {
    corners_.clear();
    displaced_.clear();
    // The vertex that goes is one of the points from now on.
    points_.push_back({positions_[wedges_ - 1], none});
    displaced_.push_back(static_cast<uint32_t>(points_.size() - 1));
    for (uint32_t k = 0; k < pm_.ecols[ecol_].wedges; ++k) {
        const uint32_t wedge = --wedges_;
        replay_.for_corners(wedge, [&](uint32_t corner) { corners_.push_back(corner); });
        replay_.rewrite(wedge, pm_.parents[pm_.wedges_at(0) - 1 - wedge], [](uint32_t) {});
    }
    ++ecol_;
}

void LevelDistance::collect_points() {
    const auto indices = replay_.indices();
    for (const uint32_t corner : corners_) {
        const uint32_t face = corner / 3;
        for (uint32_t p = first_point_[face]; p != none; p = points_[p].next) displaced_.push_back(p);
        first_point_[face] = none;
        if (replay_.alive(face)) level_.move(face, {indices[face * 3], indices[face * 3 + 1], indices[face * 3 + 2]});
    }
    for (const uint32_t corner : corners_) {
        if (replay_.alive(corner / 3)) continue;
        replay_.leave_range(corner / 3);
        level_.remove(corner / 3);
    }
}

void LevelDistance::place_points() {
    for (const uint32_t p : displaced_) {
        Point& point = points_[p];
        const glm::dvec3 place(point.place);
        const double enough = std::max(largest_, resolution_);
        ClosestSurface::Hit hit;
        hit.triangle = ClosestSurface::no_hint;  // of a collapse that leaves none of the faces
        hit.distance = std::numeric_limits<double>::infinity();
        for (const uint32_t corner : corners_) {
            if (!level_.alive(corner / 3)) continue;
            const ClosestSurface::Hit other = level_.on(corner / 3, place);
            if (other.distance < hit.distance) hit = other;
            if (hit.distance <= enough * far_from_largest) break;
        }
        if (hit.distance > enough) {
            hit = level_.closest(place, hit.triangle, enough);
            if (hit.distance > enough) largest_ = hit.distance;
        }
        point.next = first_point_[hit.triangle];
        first_point_[hit.triangle] = p;
    }
}

// Whether another face that changed has the edge from the corner to the one before.
bool LevelDistance::other_has_edge(uint32_t face, uint32_t corner) const {
    const glm::dvec3 end = level_.position(face, (corner + 2) % 3);
    return std::ranges::any_of(corners_, [&](uint32_t other) {
        return level_.alive(other / 3) && level_.position(other / 3, (other % 3 + 1) % 3) == end;
    });
}

// s and t: shares of the edges from the corner to the next and to the one after.
glm::dvec3 LevelDistance::point_of(uint32_t face, uint32_t corner, double s, double t) const {
    const glm::dvec3 a = level_.position(face, corner), b = level_.position(face, (corner + 1) % 3),
                     c = level_.position(face, (corner + 2) % 3);
    return a + (b - a) * s + (c - a) * t;
}

// Points of a face, but for the edge opposite of the corner that moved, which is as it was.
void LevelDistance::look_from(uint32_t moved) {
    const uint32_t face = moved / 3, corner = moved % 3;
    const glm::dvec3 a = level_.position(face, 0), b = level_.position(face, 1), c = level_.position(face, 2);
    const double area = glm::length(glm::cross(b - a, c - a)) / 2;
    const double longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
    const double wanted = std::max(std::sqrt(2 * area * samples_per_area_), spacing_ > 0 ? longest / spacing_ / 8 : 0);
    const auto grid = static_cast<uint32_t>(std::clamp(std::ceil(wanted), least_grid, most_grid));
    ClosestSurface::Hit worst;
    double worst_s = 0, worst_t = 0;
    uint32_t hint = source_near_[face];
    // The edge to the corner before is that of another face to the one after.
    const uint32_t first = other_has_edge(face, corner) ? 1 : 0;
    for (uint32_t i = first; i < grid; ++i) {
        for (uint32_t j = i == 0 ? 1 : 0; i + j < grid; ++j) {
            const double s = static_cast<double>(i) / grid, t = static_cast<double>(j) / grid;
            const double enough = std::max(largest_ * near_largest, resolution_);
            const auto hit = source_.closest(point_of(face, corner, s, t), hint, enough);
            hint = hit.triangle;
            if (hit.distance > enough && hit.distance > worst.distance) {
                worst = hit;
                worst_s = s;
                worst_t = t;
            }
        }
    }
    source_near_[face] = hint;
    if (worst.distance > 0) largest_ = std::max(largest_, climb(face, corner, worst_s, worst_t, 0.5 / grid, worst));
}

// The largest distance found by going from the point to the farthest of its neighbours while the grid gets finer.
double LevelDistance::climb(uint32_t face, uint32_t corner, double s, double t, double step,
                            ClosestSurface::Hit hit) const {
    constexpr std::array<std::array<double, 2>, 6> ways = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
    for (int round = 0; round < climb_steps; ++round, step /= 2) {
        for (const auto& [ds, dt] : ways) {
            const double s2 = s + ds * step, t2 = t + dt * step;
            if (s2 < 0 || t2 < 0 || s2 + t2 > 1) continue;
            const auto other = source_.closest(point_of(face, corner, s2, t2), hit.triangle, hit.distance);
            if (other.distance <= hit.distance) continue;
            hit = other;
            s = s2;
            t = t2;
        }
    }
    return hit.distance;
}

}  // namespace lodestone
