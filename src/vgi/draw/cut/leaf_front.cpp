#include "vgi/draw/cut/leaf_front.h"

namespace lodestone::vgi {

bool LeafFront::wants(uint32_t page, Slack& slack) const {
    const uint32_t leaf = residency_.topology().leaf(page);
    if (leaf == ~0u) return false;
    return forced_ ? all_ : wanted_.is_wanted(texel_of(residency_.about().leaves[leaf]), slack);
}

LeafBorder LeafFront::border(uint32_t page, Slack& slack) const {
    const uint32_t leaf = residency_.topology().leaf(page);
    LeafBorder border;
    for (uint32_t s = 0; s < 4; ++s) {
        const uint32_t across = residency_.neighbour(page, s);
        border.sampled[s] = across != ~0u && !draws(across, slack);
        for (const uint32_t other : residency_.topology().around_corner(leaf, s))
            border.corner_sampled[s] = border.corner_sampled[s] || !draws(other, slack);
    }
    return border;
}

}  // namespace lodestone::vgi
