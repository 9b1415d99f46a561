// A hierarchy over the instances of a scene: a node's sphere holds those of all instances below it, so that instances
// no view sees cost nothing below the node that says so.
#pragma once

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

// A tree of spheres over a set, kept from frame to frame.
class InstanceTree {
public:
    // Where an instance is: its sphere in world space.
    using SphereOf = std::function<Sphere(const Instance&)>;
    // An empty tree; sphere_of is called whenever an instance comes or moves.
    explicit InstanceTree(SphereOf sphere_of) : sphere_of_(std::move(sphere_of)) {}

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
    static constexpr uint32_t leaf_instances = 4;
    struct Node {
        Sphere sphere;
        uint32_t first = 0, count = 0;  // leaf: of order_; inner nodes: the left child, the right one follows it, and 0
        uint32_t parent = 0;            // of the root: itself
    };
    // What is kept of an instance.
    struct Kept {
        Sphere sphere;  // world space
        uint32_t leaf;  // its node
    };
    void build(const InstanceSet& instances);
    void move(uint32_t number, const Instance& there);
    Sphere around(const Node& node) const;

    SphereOf sphere_of_;
    uint64_t generation_ = 0;  // of the set that was seen last; the set itself is not kept
    std::vector<Node> nodes_;
    std::vector<uint32_t> order_;  // instances, leaf after leaf
    std::vector<Kept> kept_;       // per instance
    size_t grown_ = 0;             // how often nodes have grown since the tree was built
};

}  // namespace lodestone
