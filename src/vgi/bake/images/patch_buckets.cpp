#include "vgi/bake/images/patch_buckets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesh/distance/closest_point.h"

namespace lodestone::vgi {

PatchBuckets::PatchBuckets(const ChartMesh& patch, uint32_t side)
    : patch_(patch), side_(side), first_(size_t{side} * side + 1, 0) {
    const auto for_buckets = [&](const SurfaceTriangle& t, auto&& visit) {
        const glm::dvec2 &a = patch.flat[t.vertices[0]], &b = patch.flat[t.vertices[1]], &c = patch.flat[t.vertices[2]];
        const auto bucket = [&](double at) {
            return static_cast<uint32_t>(std::clamp(std::floor(at * side), 0.0, side - 1.0));
        };
        const glm::dvec2 low = glm::min(a, glm::min(b, c)), high = glm::max(a, glm::max(b, c));
        for (uint32_t y = bucket(low.y); y <= bucket(high.y); ++y) {
            for (uint32_t x = bucket(low.x); x <= bucket(high.x); ++x) visit(y * side + x);
        }
    };
    for (const SurfaceTriangle& t : patch.triangles) for_buckets(t, [&](uint32_t b) { ++first_[b + 1]; });
    for (size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
    triangles_.resize(first_.back());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t t = 0; t < patch.triangles.size(); ++t)
        for_buckets(patch.triangles[t], [&](uint32_t b) { triangles_[next[b]++] = t; });
    for (const SurfaceTriangle& t : patch.triangles) {
        const std::array<glm::dvec3, 3> at{patch.positions[t.vertices[0]], patch.positions[t.vertices[1]],
                                           patch.positions[t.vertices[2]]};
        Ball ball{(at[0] + at[1] + at[2]) / 3.0, 0};
        for (const glm::dvec3& p : at) ball.radius = std::max(ball.radius, glm::distance(p, ball.centre));
        balls_.push_back(ball);
    }
}

double PatchBuckets::squared_distance(const glm::dvec3& point, uint32_t x, uint32_t y, double most,
                                      double enough) const {
    double best = most, distance = std::sqrt(most);
    for (uint32_t row = y > 0 ? y - 1 : 0; row <= std::min(y, side_ - 1); ++row) {
        for (uint32_t column = x > 0 ? x - 1 : 0; column <= std::min(x, side_ - 1); ++column) {
            const size_t bucket = size_t{row} * side_ + column;
            for (uint32_t i = first_[bucket]; i < first_[bucket + 1] && best > enough; ++i) {
                const Ball& ball = balls_[triangles_[i]];
                const glm::dvec3 to_ball = ball.centre - point;
                const double reach = distance + ball.radius;
                if (glm::dot(to_ball, to_ball) >= reach * reach) continue;
                const auto& v = patch_.triangles[triangles_[i]].vertices;
                const glm::dvec3 off =
                    closest_on_triangle(point, patch_.positions[v[0]], patch_.positions[v[1]], patch_.positions[v[2]]) -
                    point;
                if (const double squared = glm::dot(off, off); squared < best) {
                    best = squared;
                    distance = std::sqrt(best);
                }
            }
        }
    }
    return best;
}

}  // namespace lodestone::vgi
