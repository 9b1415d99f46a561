#include "lod/bake/level_distance.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "base/none.h"
#include "lod/asset/cursor.h"
#include "mesh/distance/closest_point.h"
#include "mesh/distance/distance.h"

namespace lodestone {

namespace {

constexpr double near_largest = 0.85;      // of the largest distance: points farther than that are looked around
constexpr double far_from_largest = 0.25;  // of it: a face that near to a point is kept without looking at others
constexpr int climb_steps = 6;             // halvings of the grid around them
constexpr double least_grid = 4, most_grid = 256, most_needle = 8;  // points along an edge, of slender faces

// Points of a triangle, by shares of the edges from its first corner.
struct Patch {
    glm::dvec3 a, b, c;
    glm::dvec3 at(double s, double t) const { return a + (b - a) * s + (c - a) * t; }
};

// A place on a patch, and the triangle of the other surface that is closest to it.
struct Spot {
    double s, t;
    ClosestSurface::Hit hit;
};

// The farthest spot found by going from one to the farthest of its neighbours while the step gets finer.
// closest(place, hint, near_enough): of the other surface.
template <class Closest>
Spot climbed(const Patch& patch, Spot spot, double step, Closest&& closest) {
    constexpr std::array<std::array<double, 2>, 6> ways = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
    for (int round = 0; round < climb_steps; ++round, step /= 2) {
        for (const auto& [ds, dt] : ways) {
            const double s = spot.s + ds * step, t = spot.t + dt * step;
            if (s < 0 || t < 0 || s + t > 1) continue;
            const auto hit = closest(patch.at(s, t), spot.hit.triangle, spot.hit.distance);
            if (hit.distance > spot.hit.distance) spot = {s, t, hit};
        }
    }
    return spot;
}

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
    const TriMesh mesh = mesh_of(PmCursor(pm));
    LODE_CHECK(mesh.triangle_count() == pm.full_triangles(), mesh.triangle_count(), pm.full_triangles());
    resolution_ = resolution_of(mesh);
    for (const SurfacePoint& p : points_by_area(mesh, options.samples, options.seed)) {
        points_.push_back({glm::vec3(p.place), first_point_[p.triangle]});
        first_point_[p.triangle] = static_cast<uint32_t>(points_.size() - 1);
        sampled_.push_back(p.triangle);
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
        const double enough = std::max(largest_ * near_largest, resolution_);
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
            if (hit.distance > enough) look_around(p, hit);
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

// Whether one of the source triangles last found near the faces that changed is near enough.
bool LevelDistance::near_source(const glm::dvec3& place, double enough) const {
    constexpr size_t most = 6;
    const auto& indices = pm_.orders[0].indices;
    for (const uint32_t corner : std::span(corners_).first(std::min(most, corners_.size()))) {
        const size_t t = size_t{source_near_[corner / 3]} * 3;
        const glm::dvec3 q =
            closest_on_triangle(place, positions_[indices[t]], positions_[indices[t + 1]], positions_[indices[t + 2]]);
        if (glm::dot(place - q, place - q) <= enough * enough) return true;
    }
    return false;
}

// Points of a face, but for the edge opposite of the corner that moved, which is as it was.
void LevelDistance::look_from(uint32_t moved) {
    const uint32_t face = moved / 3, corner = moved % 3;
    const glm::dvec3 a = level_.position(face, 0), b = level_.position(face, 1), c = level_.position(face, 2);
    const double area = glm::length(glm::cross(b - a, c - a)) / 2;
    const double longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
    const double enough = std::max(largest_ * near_largest, resolution_);
    // Corners are vertices of the source, and no point of the face is farther from all of them.
    if (longest * longest <= 3 * enough * enough) return;
    const double along = spacing_ > 0 ? std::min(longest / spacing_ / 8, most_needle) : 0;
    const double wanted = std::max(std::sqrt(2 * area * samples_per_area_), along);
    const auto grid = static_cast<uint32_t>(std::clamp(std::ceil(wanted), least_grid, most_grid));
    const Patch patch = {level_.position(face, corner), level_.position(face, (corner + 1) % 3),
                         level_.position(face, (corner + 2) % 3)};
    Spot worst = {0, 0, {}};
    uint32_t hint = source_near_[face];
    // The edge to the corner before is that of another face to the one after.
    const uint32_t first = other_has_edge(face, corner) ? 1 : 0;
    for (uint32_t i = first; i < grid; ++i) {
        for (uint32_t j = i == 0 ? 1 : 0; i + j < grid; ++j) {
            const double s = static_cast<double>(i) / grid, t = static_cast<double>(j) / grid;
            if (near_source(patch.at(s, t), enough)) continue;
            const auto hit = source_.closest(patch.at(s, t), hint, enough);
            hint = hit.triangle;
            if (hit.distance > enough && hit.distance > worst.hit.distance) worst = {s, t, hit};
        }
    }
    source_near_[face] = hint;
    if (worst.hit.distance <= 0) return;
    worst = climbed(patch, worst, 0.5 / grid, [&](const glm::dvec3& place, uint32_t near, double near_enough) {
        return source_.closest(place, near, near_enough);
    });
    note(worst.hit.distance, patch.at(worst.s, worst.t), false);
}

// Of a vertex that goes nothing is farther around it; of a sample, what is near it on its triangle of the source.
void LevelDistance::look_around(uint32_t point, const ClosestSurface::Hit& hit) {
    const glm::dvec3 place(points_[point].place);
    note(hit.distance, place, true);
    if (point >= sampled_.size()) return;
    const auto& corners = pm_.orders[0].indices.subspan(size_t{sampled_[point]} * 3, 3);
    const Patch patch = {positions_[corners[0]], positions_[corners[1]], positions_[corners[2]]};
    // Shares of the edges from the areas of the triangles that the place makes with them.
    const glm::dvec3 ab = patch.b - patch.a, ac = patch.c - patch.a, ap = place - patch.a, normal = glm::cross(ab, ac);
    const double area2 = glm::dot(normal, normal);
    if (area2 <= 0) return;
    const double s = std::clamp(glm::dot(glm::cross(ap, ac), normal) / area2, 0.0, 1.0),
                 t = std::clamp(glm::dot(glm::cross(ab, ap), normal) / area2, 0.0, 1.0 - s);
    const Spot spot = climbed(patch, {s, t, hit}, 0.25, [&](const glm::dvec3& at, uint32_t near, double near_enough) {
        return level_.closest(at, near, near_enough);
    });
    note(spot.hit.distance, patch.at(spot.s, spot.t), true);
}

void LevelDistance::note(double distance, const glm::dvec3& place, bool of_source) {
    if (distance <= std::max(largest_, resolution_)) return;
    largest_ = distance;
    witness_ = {place, of_source};
}

}  // namespace lodestone
