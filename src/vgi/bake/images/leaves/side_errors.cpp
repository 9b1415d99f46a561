#include "vgi/bake/images/leaves/side_errors.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "mesh/distance/distance.h"
#include "vgi/asset/leaves/leaf_triangles.h"

namespace lodestone::vgi {

namespace {

struct SideCorner {
    glm::dvec3 at{0};
    bool on_side = false;
    bool operator==(const SideCorner&) const = default;
};
using SideTriangle = std::array<SideCorner, 3>;

// Triangles of a leaf of which all are looked at.
constexpr size_t small_leaf = 128;

// The corners, the middles of the edges and the middle of a triangle.
std::array<glm::dvec3, 7> points_of(const SideTriangle& t) {
    const glm::dvec3 &a = t[0].at, &b = t[1].at, &c = t[2].at;
    return {a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0};
}

// Triangles that end at a side, across which the surface goes on.
class EndingSurface {
public:
    explicit EndingSurface(std::vector<SideTriangle> triangles) : triangles_(std::move(triangles)) {
        std::vector<glm::vec3> positions;
        std::vector<uint32_t> indices;
        for (const SideTriangle& t : triangles_) {
            for (const SideCorner& c : t) {
                indices.push_back(static_cast<uint32_t>(indices.size()));
                positions.emplace_back(c.at);
            }
        }
        if (!indices.empty()) closest_.emplace(positions, indices);
    }

    // How far points of others are from it, at most, or `worst` where that is more.
    double farthest(const std::vector<SideTriangle>& others, double worst) const {
        if (!closest_) return worst;
        uint32_t hint = ClosestSurface::no_hint;
        for (const SideTriangle& t : others) {
            for (const glm::dvec3& point : points_of(t)) {
                const ClosestSurface::Hit hit = closest_->closest(point, hint, worst);
                hint = hit.triangle;
                if (hit.distance > worst) worst = std::max(worst, off(point, hit));
            }
        }
        return worst;
    }

private:
    // Beyond the side it goes on as the triangle there does.
    double off(const glm::dvec3& point, const ClosestSurface::Hit& hit) const {
        const SideTriangle& t = triangles_[hit.triangle];
        for (uint32_t k = 0; k < 3; ++k) {
            const SideCorner &a = t[k], &b = t[(k + 1) % 3], &c = t[(k + 2) % 3];
            if (!a.on_side || !b.on_side) continue;
            const glm::dvec3 normal = glm::cross(b.at - a.at, c.at - a.at);
            const double size = glm::length(normal);
            const double inside = glm::length(glm::cross(b.at - a.at, hit.point - a.at));
            if (size > 0 && inside < 1e-3 * size) return std::abs(glm::dot(normal, point - hit.point)) / size;
        }
        return hit.distance;
    }

    std::vector<SideTriangle> triangles_;
    std::optional<ClosestSurface> closest_;
};

class LeafSides {
public:
    LeafSides(const Atlas& atlas, const SampleDepths& depths, Atlas::Tile square, std::span<const LeafPart> parts)
        : atlas_(atlas),
          square_(square),
          depths_(depths.of(atlas.leaf(square.chart, square.x, square.y))),
          cells_(atlas.cells_of(square.chart) / atlas.leaves_per_side(square.chart)),
          parts_(parts) {
        size_t triangles = 0;
        for (const LeafPart& part : parts) triangles += part.triangles.size();
        few_ = triangles <= small_leaf;
    }

    double off(uint32_t side) const {
        LeafBorder border;
        border.levels[side] = depths_.sides[side];
        border.sampled[side] = border.corner_sampled[side] = border.corner_sampled[(side + 1) % 4] = true;
        std::vector<SideTriangle> own, drawn, own_moved, drawn_moved;
        for (const LeafPart& part : parts_) {
            const LeafPart some = some_of(part, [&](const LeafVertex& v) { return v.on_side(side); });
            add(some, {}, side, own_moved);
            add(some, border, side, drawn_moved);
        }
        if (own_moved.empty() && drawn_moved.empty()) return 0;
        for (const LeafPart& part : parts_) {
            const LeafPart some = some_of(part, [&](const LeafVertex& v) { return is_near(v, side); });
            add(some, {}, side, own);
            add(some, border, side, drawn);
        }
        return EndingSurface(std::move(drawn))
            .farthest(own_moved, EndingSurface(std::move(own)).farthest(drawn_moved, 0));
    }

private:
    // Triangles with a corner that is chosen.
    template <class IsChosen>
    static LeafPart some_of(const LeafPart& part, const IsChosen& is_chosen) {
        std::vector<bool> chosen;
        for (const LeafVertex& v : part.vertices) chosen.push_back(is_chosen(v));
        LeafPart some{part.vertices, {}};
        std::ranges::copy_if(part.triangles, std::back_inserter(some.triangles), [&](const auto& t) {
            return std::ranges::any_of(t, [&](uint8_t v) { return chosen[v]; });
        });
        return some;
    }
    // Whether something that moves along a side may come near a vertex: all of a leaf of few triangles, and what lies
    // within a few steps of samples of the side.
    bool is_near(const LeafVertex& v, uint32_t side) const {
        constexpr double steps = 3;
        const double cell = static_cast<double>(leaf_places) / atlas_.cells_of(square_.chart);
        const uint32_t axis = side % 2 == 0 ? 1 : 0;  // across the side
        const uint32_t line = (axis == 0 ? square_.x : square_.y) + (side == 1 || side == 2 ? 1 : 0);
        const double away = std::abs(v.place[axis] - line * cells_ * cell);
        return few_ || v.on_side(side) || away <= steps * cell * (1u << depths_.sides[side]);
    }
    void add(const LeafPart& part, const LeafBorder& border, uint32_t side, std::vector<SideTriangle>& to) const {
        const auto own = [&](uint32_t v) {
            return SideCorner{atlas_.leaf_point(part.vertices[v].position), part.vertices[v].on_side(side)};
        };
        const auto sample = [&](GridPoint p) {
            return SideCorner{atlas_.point(atlas_.texel(square_.chart, square_.x * cells_ + static_cast<uint32_t>(p.x),
                                                        square_.y * cells_ + static_cast<uint32_t>(p.y))),
                              true};
        };
        const auto visit = [&](const SideCorner& a, const SideCorner& b, const SideCorner& c) {
            to.push_back({a, b, c});
        };
        for_drawn_triangles(part, border, static_cast<int32_t>(cells_), own, sample, visit);
    }

    const Atlas& atlas_;
    const Atlas::Tile square_;
    const SquareDepths depths_;
    const uint32_t cells_;
    const std::span<const LeafPart> parts_;
    bool few_ = false;  // triangles
};

}  // namespace

std::array<double, 4> side_errors(const Atlas& atlas, const SampleDepths& depths, Atlas::Tile square,
                                  std::span<const LeafPart> parts) {
    const LeafSides sides(atlas, depths, square, parts);
    return {sides.off(0), sides.off(1), sides.off(2), sides.off(3)};
}

}  // namespace lodestone::vgi
