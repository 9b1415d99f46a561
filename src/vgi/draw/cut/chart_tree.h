// A hierarchy over the charts of an atlas, above their trees of pages: a node's sphere and cone hold those of all
// charts below it, so that charts no view sees cost nothing below the node that says so.
//
//   Clark, "Hierarchical geometric models for visible surface algorithms", CACM 1976.
#pragma once

#include <cstdint>
#include <vector>

#include "frame/screen_error.h"
#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

class Visibility;

class ChartTree {
public:
    ChartTree() = default;
    // about: bounds of pages are there; only they are used.
    explicit ChartTree(const Atlas& about);

    // Around all charts, object units.
    Sphere sphere() const {
        return nodes_.empty() ? Sphere{} : Sphere{nodes_[0].bounds.centre, nodes_[0].bounds.radius};
    }

    // Charts whose coarsest page some view may see, rising. about: of this atlas.
    std::vector<uint32_t> seen(const Visibility& visibility, const Atlas& about) const;

    // Every node holds the spheres of what is below it, every chart is below one leaf.
    Result<void> validate(const Atlas& about) const;

private:
    static constexpr uint32_t leaf_charts = 4;
    struct Node {
        PageBounds bounds;  // centre, radius and cone
        uint32_t first = 0,
                 count = 0;  // leaf: of charts_; inner nodes: the left child, the right one follows it, and 0
    };
    void build(const Atlas& about);

    std::vector<Node> nodes_;
    std::vector<uint32_t> charts_;
};

}  // namespace lodestone::vgi
