// A hierarchy over the instances of a scene: a node's sphere holds those of all instances below it, so that instances
// no view sees cost nothing below the node that says so.
//
//   Clark, "Hierarchical geometric models for visible surface algorithms", CACM 1976.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/result.h"
#include "frame/instance_set.h"
#include "frame/screen_error.h"
#include "frame/view.h"

namespace lodestone {

// Things halved again and again across their longest extent, four at most to a leaf.
class HalvedTree {
public:
    // The root is node 0; a child's number is higher than its parent's.
    struct Node {
        uint32_t first = 0, count = 0;  // its things, side by side in the order
        uint32_t left = 0;              // child, the right one follows it; 0: a leaf
        uint32_t parent = 0;            // of the root: itself
    };
    HalvedTree() = default;
    // Of things that are there, by number.
    explicit HalvedTree(std::span<const glm::vec3> centres);

    std::span<const Node> nodes() const { return nodes_; }  // none where there are no things
    // The numbers of the things below a node.
    std::span<const uint32_t> below(const Node& node) const {
        return std::span(order_).subspan(node.first, node.count);
    }
    // Calls found(thing, views) for whatever some view sees, rising; all: every view.
    //   seen_node(node's number, views)  those of the views that may see something below it
    //   seen_thing(number, views)        those of the views that see it
    template <class SeenNode, class SeenThing, class Found>
    void visit(uint32_t all, SeenNode&& seen_node, SeenThing&& seen_thing, Found&& found) const {
        std::vector<std::pair<uint32_t, uint32_t>> open, things;  // node or thing, views
        open.reserve(32);
        things.reserve(32);
        if (!nodes_.empty()) open.emplace_back(0, all);
        while (!open.empty()) {
            const auto [number, views] = open.back();
            open.pop_back();
            const Node& node = nodes_[number];
            const uint32_t some = seen_node(number, views);
            if (some == 0) continue;
            if (node.left != 0) {
                open.emplace_back(node.left, some);
                open.emplace_back(node.left + 1, some);
                continue;
            }
            for (const uint32_t thing : below(node)) {
                if (const uint32_t seen_by = seen_thing(thing, some); seen_by != 0) things.emplace_back(thing, seen_by);
            }
        }
        if (16 * things.size() < order_.size()) {
            std::ranges::sort(things);
            for (const auto& [thing, views] : things) found(thing, views);
            return;
        }
        std::vector<uint32_t> views_of(order_.size(), 0);
        for (const auto& [thing, views] : things) views_of[thing] = views;
        for (uint32_t thing = 0; thing < views_of.size(); ++thing) {
            if (views_of[thing] != 0) found(thing, views_of[thing]);
        }
    }

private:
    std::vector<Node> nodes_;
    std::vector<uint32_t> order_;  // things, leaf after leaf
};

// A tree of spheres over a set, kept from frame to frame.
class InstanceTree {
public:
    InstanceTree() = default;
    // An empty tree, for instances of these assets. sphere_of(asset): its sphere, object space.
    template <class Assets, class SphereOf = std::identity>
    explicit InstanceTree(const Assets& assets, SphereOf&& sphere_of = {}) {
        for (const auto& asset : assets) of_assets_.push_back(std::invoke(sphere_of, asset));
    }

    // The tree of this set. Nodes grow around what moved out of them since the last call; the tree is built anew where
    // instances came or went, and after nodes have grown as often as there are instances.
    void update(const InstanceSet& instances);

    // An instance that is seen.
    struct Seen {
        uint32_t instance, views;  // views: bit v for frusta[v]
        bool operator==(const Seen&) const = default;
    };
    // Instances whose spheres touch one of the frusta, rising; at most 32 frusta.
    std::vector<Seen> seen(std::span<const Frustum> frusta) const;

    // Every node holds the spheres of what is below it, every instance is in one leaf.
    Result<void> validate() const;

private:
    // What is kept of an instance.
    struct Kept {
        Sphere sphere;  // world space
        uint32_t leaf;  // its node
    };
    void build(const InstanceSet& instances);
    void move(uint32_t number, const Instance& there);

    Sphere sphere_of(const Instance& instance) const;

    std::vector<Sphere> of_assets_;
    uint64_t generation_ = 0;  // of the set that was seen last; the set itself is not kept
    HalvedTree tree_;
    std::vector<Sphere> around_;  // per node: what is below it
    std::vector<Kept> kept_;      // per instance
    size_t grown_ = 0;            // how often nodes have grown since the tree was built
};

}  // namespace lodestone
