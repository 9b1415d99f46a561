#include "mesh/distance/moving_surface.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "base/check.h"
#include "mesh/distance/closest_point.h"

namespace lodestone {

namespace {

double distance2(const glm::dvec3& p, const glm::vec3& low, const glm::vec3& high) {
    const glm::dvec3 outside = glm::max(glm::max(glm::dvec3(low) - p, p - glm::dvec3(high)), glm::dvec3(0));
    return glm::dot(outside, outside);
}

}  // namespace

MovingSurface::MovingSurface(std::span<const glm::vec3> positions, std::span<const uint32_t> indices)
    : positions_(positions), corners_(indices.size() / 3), leaf_(indices.size() / 3, 0), alive_(indices.size() / 3) {
    LODE_CHECK(!indices.empty() && indices.size() % 3 == 0, indices.size());
    for (size_t t = 0; t < corners_.size(); ++t) corners_[t] = {indices[t * 3], indices[t * 3 + 1], indices[t * 3 + 2]};
    build();
}

void MovingSurface::build() {
    order_.clear();
    nodes_.clear();
    std::vector<glm::vec3> centres(corners_.size());
    for (uint32_t t = 0; t < corners_.size(); ++t) {
        if (!alive(t)) continue;
        order_.push_back(t);
        const auto& [a, b, c] = corners_[t];
        centres[t] = glm::min(glm::min(positions_[a], positions_[b]), positions_[c]) * 0.5f +
                     glm::max(glm::max(positions_[a], positions_[b]), positions_[c]) * 0.5f;
    }
    built_ = alive_ = order_.size();
    nodes_.push_back({{}, {}, nowhere, 0, static_cast<uint32_t>(order_.size())});
    std::vector<uint32_t> open = {0};
    while (!open.empty()) {
        const uint32_t node = open.back();
        open.pop_back();
        split(node, open, centres);
    }
}

// At the median: no tree is then deeper than 32.
void MovingSurface::split(uint32_t node, std::vector<uint32_t>& open, std::span<const glm::vec3> centres) {
    const uint32_t first = nodes_[node].first, count = nodes_[node].count;
    const auto begin = order_.begin() + first, end = begin + count;
    glm::vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    Box middles{low, high};
    for (auto t = begin; t != end; ++t) {
        for (const uint32_t corner : corners_[*t]) {
            low = glm::min(low, positions_[corner]);
            high = glm::max(high, positions_[corner]);
        }
        middles.low = glm::min(middles.low, centres[*t]);
        middles.high = glm::max(middles.high, centres[*t]);
    }
    nodes_[node].low = low;
    nodes_[node].high = high;
    if (count <= leaf_size) {
        for (auto t = begin; t != end; ++t) leaf_[*t] = node;
        return;
    }
    const int axis = middles.longest_axis();
    const auto middle = begin + count / 2;
    std::nth_element(begin, middle, end, [&](uint32_t a, uint32_t b) {
        return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b;
    });
    const auto left = static_cast<uint32_t>(nodes_.size());
    nodes_.push_back({{}, {}, node, first, count / 2});
    nodes_.push_back({{}, {}, node, first + count / 2, count - count / 2});
    nodes_[node].first = left;
    nodes_[node].count = 0;
    open.push_back(left);
    open.push_back(left + 1);
}

void MovingSurface::grow(uint32_t triangle) {
    const auto& [a, b, c] = corners_[triangle];
    const glm::vec3 low = glm::min(glm::min(positions_[a], positions_[b]), positions_[c]);
    const glm::vec3 high = glm::max(glm::max(positions_[a], positions_[b]), positions_[c]);
    for (uint32_t n = leaf_[triangle]; n != nowhere; n = nodes_[n].parent) {
        Node& node = nodes_[n];
        const glm::vec3 lower = glm::min(node.low, low), higher = glm::max(node.high, high);
        if (lower == node.low && higher == node.high) return;
        node.low = lower;
        node.high = higher;
    }
}

void MovingSurface::move(uint32_t triangle, const std::array<uint32_t, 3>& corners) {
    LODE_CHECK(alive(triangle), triangle);
    corners_[triangle] = corners;
    grow(triangle);
}

void MovingSurface::remove(uint32_t triangle) {
    LODE_CHECK(alive(triangle) && alive_ > 1, triangle, alive_);
    leaf_[triangle] = nowhere;
    if (--alive_ * 2 < built_) build();
}

ClosestSurface::Hit MovingSurface::on(uint32_t triangle, const glm::dvec3& point) const {
    const auto& [a, b, c] = corners_[triangle];
    const glm::dvec3 q = closest_on_triangle(point, positions_[a], positions_[b], positions_[c]);
    return {glm::length(point - q), triangle, q};
}

ClosestSurface::Hit MovingSurface::closest(const glm::dvec3& point, uint32_t hint, double near_enough) const {
    ClosestSurface::Hit hit;
    hit.distance = std::numeric_limits<double>::infinity();
    if (hint != ClosestSurface::no_hint) hit = on(hint, point);
    struct Entry {
        uint32_t node;
        double distance2;
    };
    std::array<Entry, 64> stack;
    size_t depth = 0;
    double best2 = hit.distance * hit.distance;
    stack[depth++] = {0, distance2(point, nodes_[0].low, nodes_[0].high)};
    while (depth > 0 && hit.distance > near_enough) {
        const Entry entry = stack[--depth];
        if (entry.distance2 >= best2) continue;
        const Node& node = nodes_[entry.node];
        if (node.count > 0) {
            for (uint32_t i = node.first; i < node.first + node.count; ++i) {
                if (!alive(order_[i])) continue;
                const ClosestSurface::Hit other = on(order_[i], point);
                if (other.distance < hit.distance) hit = other;
            }
            best2 = hit.distance * hit.distance;
            continue;
        }
        Entry near = {node.first, 0}, far = {node.first + 1, 0};
        for (Entry* child : {&near, &far})
            child->distance2 = distance2(point, nodes_[child->node].low, nodes_[child->node].high);
        if (far.distance2 < near.distance2) std::swap(near, far);
        stack[depth++] = far;
        stack[depth++] = near;
    }
    return hit;
}

}  // namespace lodestone
