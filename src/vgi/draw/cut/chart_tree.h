// A hierarchy over the charts of an atlas, above their trees of pages: a node's sphere and cone hold those of all
// charts below it, so that charts no view sees cost nothing below the node that says so.
#pragma once

#include <cstdint>
#include <vector>

#include "frame/instance_tree.h"
#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

class Visibility;

class ChartTree {
public:
    ChartTree() = default;
    // about: bounds of pages are there; only they are used.
    explicit ChartTree(const Atlas& about);

    // Around all charts, object units.
    Sphere sphere() const { return around_.empty() ? Sphere{} : Sphere{around_[0].centre, around_[0].radius}; }

    // Charts whose coarsest page some view may see, rising. about: of this atlas.
    std::vector<uint32_t> seen(const Visibility& visibility, const Atlas& about) const;

    // Every node holds the spheres of what is below it, every chart is below the root.
    Result<void> validate(const Atlas& about) const;

private:
    HalvedTree tree_;
    std::vector<PageBounds> around_;  // per node: centre, radius and cone
};

}  // namespace lodestone::vgi
