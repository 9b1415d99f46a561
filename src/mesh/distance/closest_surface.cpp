#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <numeric>

#include "base/check.h"
#include "mesh/distance/closest_point.h"
#include "mesh/distance/distance.h"

namespace lodestone {

namespace {

struct FloatBox {
    glm::vec3 low{std::numeric_limits<float>::max()}, high{std::numeric_limits<float>::lowest()};

    void add(const glm::vec3& p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    // Rounded outwards.
    void add(const glm::dvec3& p) {
        for (int k = 0; k < 3; ++k) {
            const auto near = static_cast<float>(p[k]);
            const bool below = static_cast<double>(near) <= p[k], above = static_cast<double>(near) >= p[k];
            low[k] = std::min(low[k], below ? near : std::nextafter(near, std::numeric_limits<float>::lowest()));
            high[k] = std::max(high[k], above ? near : std::nextafter(near, std::numeric_limits<float>::max()));
        }
    }
    glm::dvec3 size() const { return glm::dvec3(high) - glm::dvec3(low); }
    double half_area() const {
        const glm::dvec3 s = size();
        return s.x * s.y + s.y * s.z + s.z * s.x;
    }
    // Rounding does not take it out of the box.
    glm::vec3 centre() const { return glm::clamp(low * 0.5f + high * 0.5f, low, high); }
};

// A part of a triangle: what of it lies in a box.
struct Piece {
    uint32_t triangle = 0;
    FloatBox box;
};
using Polygon = std::vector<glm::dvec3>;

FloatBox box_of(const Polygon& polygon) {
    FloatBox box;
    for (const glm::dvec3& p : polygon) box.add(p);
    return box;
}

// The parts of a convex polygon below and above a plane across an axis.
std::array<Polygon, 2> cut(const Polygon& polygon, int axis, double at) {
    std::array<Polygon, 2> parts;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        if (a[axis] <= at) parts[0].push_back(a);
        if (a[axis] >= at) parts[1].push_back(a);
        if ((a[axis] < at && b[axis] > at) || (a[axis] > at && b[axis] < at)) {
            glm::dvec3 p = a + (b - a) * ((at - a[axis]) / (b[axis] - a[axis]));
            p[axis] = at;
            parts[0].push_back(p);
            parts[1].push_back(p);
        }
    }
    return parts;
}

double area_of(const Polygon& polygon) {
    glm::dvec3 sum(0);
    for (size_t i = 2; i < polygon.size(); ++i) sum += glm::cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
    return glm::length(sum) / 2;
}

// Boxes of long triangles that run askew hold next to nothing and overlap all others: such triangles are cut into
// pieces, the largest boxes first, until boxes are about as small as they would be if all shared the surface of the
// whole. At most `most_pieces` for each triangle on the average.
// Source: Ernst, Greiner, "Early split clipping for bounding volume hierarchies", 2007; order and limit are ours.
class Pieces {
public:
    Pieces(std::span<const glm::vec3> positions, std::span<const uint32_t> indices) {
        const size_t count = indices.size() / 3;
        pieces_.resize(count);
        FloatBox whole;
        for (size_t t = 0; t < count; ++t) {
            pieces_[t].triangle = static_cast<uint32_t>(t);
            for (size_t k = 0; k < 3; ++k) pieces_[t].box.add(positions[indices[t * 3 + k]]);
            whole.add(pieces_[t].box.low);
            whole.add(pieces_[t].box.high);
        }
        least_ = small_enough * whole.half_area() / static_cast<double>(count);
        for (uint32_t t = 0; t < count; ++t) {
            if (!(pieces_[t].box.half_area() > least_)) continue;
            Polygon polygon;
            for (size_t k = 0; k < 3; ++k) polygon.emplace_back(positions[indices[t * 3 + k]]);
            consider(t, std::move(polygon));
        }
        const size_t most = std::min<size_t>(count * most_pieces, std::numeric_limits<uint32_t>::max());
        while (!large_.empty() && pieces_.size() < most) cut_largest();
    }
    std::vector<Piece> take() { return std::move(pieces_); }

private:
    static constexpr size_t most_pieces = 16;
    static constexpr double small_enough = 4;  // times an even share
    static constexpr double worth_it = 8;      // times its polygon's area that a box has to be

    struct Large {
        double half_area;
        uint32_t piece;
        Polygon polygon;
        bool operator<(const Large& o) const {
            return half_area != o.half_area ? half_area < o.half_area : piece > o.piece;
        }
    };

    void consider(uint32_t piece, Polygon polygon) {
        const double half_area = pieces_[piece].box.half_area();
        if (half_area > least_ && half_area > worth_it * area_of(polygon)) {
            large_.push_back({half_area, piece, std::move(polygon)});
            std::push_heap(large_.begin(), large_.end());
        }
    }

    void cut_largest() {
        std::pop_heap(large_.begin(), large_.end());
        const Large large = std::move(large_.back());
        large_.pop_back();
        const FloatBox box = pieces_[large.piece].box;
        const glm::dvec3 size = box.size();
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        auto parts = cut(large.polygon, axis, static_cast<double>(box.low[axis]) + size[axis] / 2);
        if (parts[0].size() < 2 || parts[1].size() < 2) return;
        pieces_[large.piece].box = box_of(parts[0]);
        pieces_.push_back({pieces_[large.piece].triangle, box_of(parts[1])});
        consider(large.piece, std::move(parts[0]));
        consider(static_cast<uint32_t>(pieces_.size() - 1), std::move(parts[1]));
    }

    std::vector<Piece> pieces_;
    std::vector<Large> large_;  // a heap
    double least_ = 0;
};

}  // namespace

// A binary tree of boxes over pieces of the triangles, split at the middle of the longest side of the box of centres
// (at the median where that separates too little). Wald, "On fast construction of SAH-based bounding volume
// hierarchies", 2007, shows why the middle is nearly as good as more costly splits for evenly tessellated meshes.
struct ClosestSurface::Tree {
    struct Node {
        glm::vec3 low, high;
        uint32_t first = 0;  // leaf: first piece; inner: the left child, the right one follows it
        uint32_t count = 0;  // leaf: pieces; 0 for inner nodes
    };
    static constexpr uint32_t leaf_size = 4;
    // A child has a sixteenth of its parent's pieces at least, so 2^32 pieces make less than 350 levels.
    static constexpr uint32_t least_share = 16;
    static constexpr size_t most_levels = 384;

    std::vector<Node> nodes;
    std::vector<std::array<glm::vec3, 3>> corners;  // of the triangle, per piece in tree order
    std::vector<uint32_t> triangle;                 // piece in tree order to the caller's triangle
    std::vector<uint32_t> place;                    // the caller's triangle to one of its pieces in tree order

    void build(std::span<const glm::vec3> positions, std::span<const uint32_t> indices) {
        std::vector<Piece> pieces = Pieces(positions, indices).take();
        const auto count = static_cast<uint32_t>(pieces.size());
        nodes.reserve(count);
        nodes.push_back({{}, {}, 0, count});
        std::vector<uint32_t> open = {0};
        while (!open.empty()) {
            const uint32_t n = open.back();
            open.pop_back();
            const uint32_t first = nodes[n].first, size = nodes[n].count;
            const auto begin = pieces.begin() + first, end = begin + size;
            FloatBox box, centres;
            for (auto it = begin; it != end; ++it) {
                box.add(it->box.low);
                box.add(it->box.high);
                centres.add(it->box.centre());
            }
            nodes[n].low = box.low;
            nodes[n].high = box.high;
            if (size <= leaf_size) continue;
            const int axis = Box{centres.low, centres.high}.longest_axis();
            const float middle = centres.centre()[axis];
            auto split = std::partition(begin, end, [&](const Piece& p) { return p.box.centre()[axis] < middle; });
            const auto least = static_cast<ptrdiff_t>(std::max(1u, size / least_share));
            if (split - begin < least || end - split < least) {
                split = begin + size / 2;
                std::nth_element(begin, split, end, [&](const Piece& a, const Piece& b) {
                    const float at_a = a.box.centre()[axis], at_b = b.box.centre()[axis];
                    return at_a != at_b ? at_a < at_b : a.triangle < b.triangle;
                });
            }
            const auto left = static_cast<uint32_t>(nodes.size());
            const auto left_count = static_cast<uint32_t>(split - begin);
            nodes.push_back({{}, {}, first, left_count});
            nodes.push_back({{}, {}, first + left_count, size - left_count});
            nodes[n].first = left;
            nodes[n].count = 0;
            open.push_back(left);
            open.push_back(left + 1);
        }
        place.resize(indices.size() / 3);
        triangle.resize(count);
        corners.resize(count);
        for (uint32_t i = 0; i < count; ++i) {
            const uint32_t t = pieces[i].triangle;
            triangle[i] = t;
            place[t] = i;
            corners[i] = {positions[indices[t * 3]], positions[indices[t * 3 + 1]], positions[indices[t * 3 + 2]]};
        }
    }

    // Squared distance to a box, in float rounded down a little so that no box is skipped for rounding.
    static double distance2(const glm::dvec3& p, const Node& node) {
        const glm::dvec3 outside =
            glm::max(glm::max(glm::dvec3(node.low) - p, p - glm::dvec3(node.high)), glm::dvec3(0));
        return glm::dot(outside, outside);
    }

    // Squared distance to the middle of a box.
    static double from_centre2(const glm::dvec3& p, const Node& node) {
        const glm::dvec3 way = (glm::dvec3(node.low) + glm::dvec3(node.high)) * 0.5 - p;
        return glm::dot(way, way);
    }

    void look_at(uint32_t i, const glm::dvec3& p, double& best2, Hit& hit) const {
        const glm::dvec3 q = closest_on_triangle(p, corners[i][0], corners[i][1], corners[i][2]);
        const double d2 = glm::dot(p - q, p - q);
        if (d2 < best2 || (d2 == best2 && triangle[i] < hit.triangle)) {
            best2 = d2;
            hit.triangle = triangle[i];
            hit.point = q;
        }
    }

    Hit closest(const glm::dvec3& p, uint32_t hint, double near_enough) const {
        Hit hit;
        hit.triangle = no_hint;
        double best2 = std::numeric_limits<double>::infinity();
        const double enough2 = near_enough < 0 ? -1 : near_enough * near_enough;
        if (hint < place.size()) look_at(place[hint], p, best2, hit);
        struct Entry {
            uint32_t node;
            double distance2;
        };
        std::array<Entry, most_levels> stack;
        size_t depth = 0;
        stack[depth++] = {0, distance2(p, nodes[0])};
        while (depth > 0 && best2 > enough2) {
            const Entry entry = stack[--depth];
            if (entry.distance2 > best2) continue;
            const Node& node = nodes[entry.node];
            if (node.count > 0) {
                for (uint32_t i = node.first; i < node.first + node.count; ++i) look_at(i, p, best2, hit);
                continue;
            }
            Entry near = {node.first, distance2(p, nodes[node.first])},
                  far = {node.first + 1, distance2(p, nodes[node.first + 1])};
            if (far.distance2 < near.distance2 ||
                (far.distance2 == near.distance2 &&
                 from_centre2(p, nodes[far.node]) < from_centre2(p, nodes[near.node]))) {
                std::swap(near, far);
            }
            if (far.distance2 <= best2) stack[depth++] = far;
            if (near.distance2 <= best2) stack[depth++] = near;
            LODE_CHECK(depth < stack.size() - 2, depth);
        }
        hit.distance = std::sqrt(best2);
        return hit;
    }
};

ClosestSurface::ClosestSurface(std::span<const glm::vec3> positions, std::span<const uint32_t> indices)
    : tree_(std::make_unique<Tree>()) {
    LODE_CHECK(!indices.empty() && indices.size() % 3 == 0, indices.size());
    tree_->build(positions, indices);
}
ClosestSurface::~ClosestSurface() = default;
ClosestSurface::ClosestSurface(ClosestSurface&&) noexcept = default;
ClosestSurface::Hit ClosestSurface::closest(const glm::dvec3& point, uint32_t hint, double near_enough) const {
    return tree_->closest(point, hint, near_enough);
}

}  // namespace lodestone
