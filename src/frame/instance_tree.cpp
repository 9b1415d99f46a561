#include "frame/instance_tree.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <string>

#include "base/check.h"

namespace lodestone {

namespace {

Sphere around_both(const Sphere& a, const Sphere& b) {
    const float apart = glm::distance(a.centre, b.centre);
    if (apart + b.radius <= a.radius) return a;
    if (apart + a.radius <= b.radius) return b;
    const float radius = (apart + a.radius + b.radius) / 2;
    return {a.centre + (b.centre - a.centre) * ((radius - a.radius) / apart), radius * 1.00001f};
}

bool holds(const Sphere& outer, const Sphere& inner) {
    return glm::distance(outer.centre, inner.centre) + inner.radius <= outer.radius;
}

}  // namespace

void InstanceTree::update(const InstanceSet& instances) {
    if (generation_ == instances.generation()) return;
    const auto changed =
        instances.size() == kept_.size() && !nodes_.empty() ? instances.changed_since(generation_) : std::nullopt;
    generation_ = instances.generation();
    if (!changed || grown_ > instances.size()) return build(instances);
    for (const uint32_t i : *changed) move(i, instances[i]);
}

void InstanceTree::build(const InstanceSet& instances) {
    const auto count = static_cast<uint32_t>(instances.size());
    nodes_.clear();
    order_.resize(count);
    kept_.resize(count);
    grown_ = 0;
    std::iota(order_.begin(), order_.end(), 0u);
    for (uint32_t i = 0; i < count; ++i) kept_[i].sphere = sphere_of_(instances[i]);
    if (count == 0) return;
    nodes_.push_back({{}, 0, count, 0});
    for (uint32_t n = 0; n < nodes_.size(); ++n) {
        const uint32_t first = nodes_[n].first, size = nodes_[n].count;
        const auto own = std::span(order_).subspan(first, size);
        if (size <= leaf_instances) {
            for (const uint32_t i : own) kept_[i].leaf = n;
            continue;
        }
        glm::vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
        for (const uint32_t i : own) {
            low = glm::min(low, kept_[i].sphere.centre);
            high = glm::max(high, kept_[i].sphere.centre);
        }
        const glm::vec3 extent = high - low;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        std::ranges::nth_element(own, own.begin() + size / 2, {},
                                 [&](uint32_t i) { return std::pair(kept_[i].sphere.centre[axis], i); });
        const auto left = static_cast<uint32_t>(nodes_.size());
        nodes_[n].first = left;
        nodes_[n].count = 0;
        nodes_.push_back({{}, first, size / 2, n});
        nodes_.push_back({{}, first + size / 2, size - size / 2, n});
    }
    for (size_t n = nodes_.size(); n-- > 0;) nodes_[n].sphere = around(nodes_[n]);
}

Sphere InstanceTree::around(const Node& node) const {
    if (node.count == 0) return around_both(nodes_[node.first].sphere, nodes_[node.first + 1].sphere);
    Sphere all = kept_[order_[node.first]].sphere;
    for (uint32_t k = 1; k < node.count; ++k) all = around_both(all, kept_[order_[node.first + k]].sphere);
    return all;
}

void InstanceTree::move(uint32_t number, const Instance& there) {
    const Sphere sphere = sphere_of_(there);
    kept_[number].sphere = sphere;
    uint32_t n = kept_[number].leaf;
    if (holds(nodes_[n].sphere, sphere)) return;
    // The leaf takes in more than it must, so that what goes on moving does not change it again at once.
    Sphere inner = {sphere.centre, sphere.radius * 1.25f};
    while (!holds(nodes_[n].sphere, inner)) {
        nodes_[n].sphere = around_both(nodes_[n].sphere, inner);
        inner = nodes_[n].sphere;
        ++grown_;
        n = nodes_[n].parent;
    }
}

std::vector<InstanceTree::Seen> InstanceTree::seen(std::span<const Frustum> frusta) const {
    LODE_CHECK(frusta.size() <= 32, frusta.size());
    std::vector<Seen> found;
    if (nodes_.empty()) return found;
    const auto touching = [&](uint32_t views, const Sphere& sphere) {
        for (uint32_t v = 0; v < frusta.size(); ++v) {
            if ((views >> v & 1) != 0 && !frusta[v].touches(sphere.centre, sphere.radius)) views &= ~(1u << v);
        }
        return views;
    };
    const uint32_t all = frusta.size() == 32 ? ~0u : (1u << frusta.size()) - 1;
    std::vector<std::pair<uint32_t, uint32_t>> open = {{0, all}};
    while (!open.empty()) {
        const auto [number, views] = open.back();
        open.pop_back();
        const Node& node = nodes_[number];
        const uint32_t mask = touching(views, node.sphere);
        if (mask == 0) continue;
        if (node.count == 0) {
            open.emplace_back(node.first, mask);
            open.emplace_back(node.first + 1, mask);
            continue;
        }
        for (const uint32_t i : std::span(order_).subspan(node.first, node.count)) {
            if (const uint32_t seen_by = touching(mask, kept_[i].sphere); seen_by != 0) found.push_back({i, seen_by});
        }
    }
    std::ranges::sort(found, {}, &Seen::instance);
    return found;
}

Result<void> InstanceTree::validate() const {
    for (uint32_t i = 0; i < kept_.size(); ++i) {
        const std::string name = "instance tree: instance " + std::to_string(i);
        const Node& leaf = nodes_[kept_[i].leaf];
        if (std::ranges::count(std::span(order_).subspan(leaf.first, leaf.count), i) != 1)
            return fail(Fault::invariant, name + " is not in its leaf");
        for (uint32_t n = kept_[i].leaf;; n = nodes_[n].parent) {
            const Sphere& s = nodes_[n].sphere;
            if (glm::distance(s.centre, kept_[i].sphere.centre) + kept_[i].sphere.radius > s.radius * 1.001f + 1e-6f)
                return fail(Fault::invariant, name + " sticks out of a node");
            if (n == 0) break;
        }
    }
    return {};
}

}  // namespace lodestone
