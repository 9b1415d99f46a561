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
    const glm::vec3 off = inner.centre - outer.centre;
    const float room = outer.radius - inner.radius;
    return room >= 0 && glm::dot(off, off) <= room * room;
}

}  // namespace

HalvedTree::HalvedTree(std::span<const glm::vec3> centres) : order_(centres.size()) {
    constexpr uint32_t most_in_leaf = 4;
    std::iota(order_.begin(), order_.end(), 0u);
    if (!order_.empty()) nodes_.push_back({0, static_cast<uint32_t>(order_.size()), 0, 0});
    for (uint32_t n = 0; n < nodes_.size(); ++n) {
        const uint32_t first = nodes_[n].first, count = nodes_[n].count;
        if (count <= most_in_leaf) continue;
        const auto own = std::span(order_).subspan(first, count);
        glm::vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
        for (const uint32_t i : own) {
            low = glm::min(low, centres[i]);
            high = glm::max(high, centres[i]);
        }
        const glm::vec3 extent = high - low;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        std::ranges::nth_element(own, own.begin() + count / 2, {},
                                 [&](uint32_t i) { return std::pair(centres[i][axis], i); });
        nodes_[n].left = static_cast<uint32_t>(nodes_.size());
        nodes_.push_back({first, count / 2, 0, n});
        nodes_.push_back({first + count / 2, count - count / 2, 0, n});
    }
}

// In world space.
Sphere InstanceTree::sphere_of(const Instance& instance) const {
    LODE_CHECK(instance.asset < of_assets_.size(), instance.asset, of_assets_.size());
    return to_world(of_assets_[instance.asset], instance.object_to_world);
}

void InstanceTree::update(const InstanceSet& instances) {
    if (generation_ == instances.generation()) return;
    const auto changed =
        instances.size() == kept_.size() && !kept_.empty() ? instances.changed_since(generation_) : std::nullopt;
    generation_ = instances.generation();
    if (!changed || grown_ > instances.size()) return build(instances);
    for (const uint32_t i : *changed) move(i, instances[i]);
}

void InstanceTree::build(const InstanceSet& instances) {
    kept_.resize(instances.size());
    grown_ = 0;
    std::vector<glm::vec3> centres;
    for (uint32_t i = 0; i < kept_.size(); ++i) {
        kept_[i].sphere = sphere_of(instances[i]);
        centres.push_back(kept_[i].sphere.centre);
    }
    tree_ = HalvedTree(centres);
    around_.resize(tree_.nodes().size());
    for (size_t n = around_.size(); n-- > 0;) {
        const HalvedTree::Node& node = tree_.nodes()[n];
        if (node.left != 0) {
            around_[n] = around_both(around_[node.left], around_[node.left + 1]);
            continue;
        }
        const auto own = tree_.below(node);
        around_[n] = kept_[own[0]].sphere;
        for (const uint32_t i : own) {
            kept_[i].leaf = static_cast<uint32_t>(n);
            around_[n] = around_both(around_[n], kept_[i].sphere);
        }
    }
}

void InstanceTree::move(uint32_t number, const Instance& there) {
    const Sphere sphere = sphere_of(there);
    kept_[number].sphere = sphere;
    uint32_t n = kept_[number].leaf;
    if (holds(around_[n], sphere)) return;
    // The leaf takes in more than it must, so that what goes on moving does not change it again at once.
    Sphere inner = {sphere.centre, sphere.radius * 1.25f};
    while (!holds(around_[n], inner)) {
        around_[n] = around_both(around_[n], inner);
        inner = around_[n];
        ++grown_;
        n = tree_.nodes()[n].parent;
    }
}

std::vector<InstanceTree::Seen> InstanceTree::seen(std::span<const Frustum> frusta) const {
    LODE_CHECK(frusta.size() <= 32, frusta.size());
    const auto touching = [&](const Sphere& sphere, uint32_t views) {
        for (uint32_t v = 0; v < frusta.size(); ++v) {
            if ((views >> v & 1) != 0 && !frusta[v].touches(sphere.centre, sphere.radius)) views &= ~(1u << v);
        }
        return views;
    };
    std::vector<Seen> found;
    tree_.visit(
        frusta.size() == 32 ? ~0u : (1u << frusta.size()) - 1,
        [&](uint32_t node, uint32_t views) { return touching(around_[node], views); },
        [&](uint32_t instance, uint32_t views) { return touching(kept_[instance].sphere, views); },
        [&](uint32_t instance, uint32_t views) {
            found.push_back({instance, views});
        });
    return found;
}

Result<void> InstanceTree::validate() const {
    for (uint32_t i = 0; i < kept_.size(); ++i) {
        const std::string name = "instance tree: instance " + std::to_string(i);
        if (std::ranges::count(tree_.below(tree_.nodes()[kept_[i].leaf]), i) != 1)
            return fail(Fault::invariant, name + " is not in its leaf");
        for (uint32_t n = kept_[i].leaf;; n = tree_.nodes()[n].parent) {
            const Sphere& s = around_[n];
            if (glm::distance(s.centre, kept_[i].sphere.centre) + kept_[i].sphere.radius > s.radius * 1.001f + 1e-6f)
                return fail(Fault::invariant, name + " sticks out of a node");
            if (n == 0) break;
        }
    }
    return {};
}

}  // namespace lodestone
