#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <numeric>

#include "base/check.h"
#include "mesh/closest_point.h"
#include "mesh/distance.h"

namespace lodestone {

// A binary tree of boxes over the triangles, split at the middle of the longest side of the box of centroids (at the
// median where that separates nothing). Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007,
// shows why the middle is nearly as good as more costly splits for evenly tessellated meshes.
struct ClosestSurface::Tree {
    struct Node {
        glm::vec3 low, high;
        uint32_t first = 0;  // leaf: first triangle; inner: the left child, the right one follows it
        uint32_t count = 0;  // leaf: triangles; 0 for inner nodes
    };
    static constexpr uint32_t leaf_size = 4;

    std::vector<Node> nodes;
    std::vector<std::array<glm::vec3, 3>> corners;  // in tree order
    std::vector<uint32_t> triangle;                 // tree order to the caller's
    std::vector<uint32_t> place;                    // the caller's order to tree order

    void build(std::span<const glm::vec3> positions, std::span<const uint32_t> indices) {
        const auto count = static_cast<uint32_t>(indices.size() / 3);
        std::vector<glm::vec3> centres(count);
        for (uint32_t t = 0; t < count; ++t) {
            centres[t] = (positions[indices[t * 3]] + positions[indices[t * 3 + 1]] + positions[indices[t * 3 + 2]]) *
                         (1.0f / 3);
        }
        triangle.resize(count);
        std::iota(triangle.begin(), triangle.end(), 0u);
        nodes.reserve(count);
        nodes.push_back({{}, {}, 0, count});
        std::vector<uint32_t> open = {0};
        while (!open.empty()) {
            const uint32_t n = open.back();
            open.pop_back();
            const uint32_t first = nodes[n].first, size = nodes[n].count;
            const auto begin = triangle.begin() + first, end = begin + size;
            glm::vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest()),
                centre_low = low, centre_high = high;
            for (auto it = begin; it != end; ++it) {
                for (uint32_t k = 0; k < 3; ++k) {
                    low = glm::min(low, positions[indices[*it * 3 + k]]);
                    high = glm::max(high, positions[indices[*it * 3 + k]]);
                }
                centre_low = glm::min(centre_low, centres[*it]);
                centre_high = glm::max(centre_high, centres[*it]);
            }
            nodes[n].low = low;
            nodes[n].high = high;
            if (size <= leaf_size) continue;
            const int axis = Box{centre_low, centre_high}.longest_axis();
            const float middle = (centre_low[axis] + centre_high[axis]) * 0.5f;
            auto split = std::partition(begin, end, [&](uint32_t t) { return centres[t][axis] < middle; });
            if (split - begin < size / 16 || end - split < size / 16) {
                split = begin + size / 2;
                std::nth_element(begin, split, end, [&](uint32_t a, uint32_t b) {
                    return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b;
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
        place.resize(count);
        corners.resize(count);
        for (uint32_t i = 0; i < count; ++i) {
            const uint32_t t = triangle[i];
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

    void look_at(uint32_t i, const glm::dvec3& p, double& best2, Hit& hit) const {
        const glm::dvec3 q = closest_on_triangle(p, corners[i][0], corners[i][1], corners[i][2]);
        const double d2 = glm::dot(p - q, p - q);
        if (d2 < best2 || (d2 == best2 && triangle[i] < hit.triangle)) {
            best2 = d2;
            hit.triangle = triangle[i];
            hit.point = q;
        }
    }

    Hit closest(const glm::dvec3& p, uint32_t hint) const {
        Hit hit;
        hit.triangle = no_hint;
        double best2 = std::numeric_limits<double>::infinity();
        if (hint < place.size()) look_at(place[hint], p, best2, hit);
        struct Entry {
            uint32_t node;
            double distance2;
        };
        std::array<Entry, 128> stack;
        size_t depth = 0;
        stack[depth++] = {0, distance2(p, nodes[0])};
        while (depth > 0) {
            const Entry entry = stack[--depth];
            if (entry.distance2 > best2) continue;
            const Node& node = nodes[entry.node];
            if (node.count > 0) {
                for (uint32_t i = node.first; i < node.first + node.count; ++i) look_at(i, p, best2, hit);
                continue;
            }
            Entry near = {node.first, distance2(p, nodes[node.first])},
                  far = {node.first + 1, distance2(p, nodes[node.first + 1])};
            if (far.distance2 < near.distance2) std::swap(near, far);
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
ClosestSurface::Hit ClosestSurface::closest(const glm::dvec3& point, uint32_t hint) const {
    return tree_->closest(point, hint);
}

}  // namespace lodestone
