// Which leaves (vgi/asset/leaves/leaves.h) a cut draws. A leaf is drawn where drawing the finest samples of its square
// would cost more than the pixel error, all its parts are there, and so is what those around it draw its sides from: a
// pure function of what all of them know.
#pragma once

#include <cstdint>

#include "vgi/asset/leaves/leaf_triangles.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

class LeafFront {
public:
    // All must outlive this.
    LeafFront(const Residency& residency, const RefinementTest& wanted, const CutRequest& request)
        : residency_(residency),
          wanted_(wanted),
          forced_(request.forced_level >= 0),
          all_(request.forced_level >= 0 && request.forced_leaves) {}

    // Whether the leaf in the square of a page is wanted; false where there is none. slack: how long that holds.
    bool wants(uint32_t page, Slack& slack) const;
    bool draws(uint32_t page, Slack& slack) const { return residency_.entry(page).leaf_usable() && wants(page, slack); }
    // What a leaf that is drawn has around it.
    LeafBorder border(uint32_t page, Slack& slack) const;
    // Which sides and corners of a finest page's square a leaf that is wanted touches, as bits of
    // PageTopology::beside_leaves.
    uint32_t beside_wanted(uint32_t page, Slack& slack) const;
    // Whether leaves ask for the sample in corner (x, y) of a chart's squares.
    bool ask_for_corner(uint32_t chart, uint32_t x, uint32_t y, Slack& slack) const;
    // Whether all vertices of one that is drawn are in their places; where not told, they may be.
    bool has_arrived(uint32_t page, const LeafBorder& border, Slack& slack) const;
    // As RefinementTest::excess. leaf: into Atlas::leaves.
    float excess(uint32_t leaf) const { return wanted_.excess(texel_of(residency_.about().leaves[leaf])); }

private:
    // leaf: into Atlas::leaves, whether there is one or not; or what counts as one.
    bool is_wanted(const Leaf& leaf, Slack& slack) const {
        return leaf.error > 0 && wanted_.is_wanted(texel_of(leaf), slack);
    }

    const Residency& residency_;
    const RefinementTest& wanted_;
    const bool forced_, all_;
};

}  // namespace lodestone::vgi
