#include "vgi/draw/leaves/leaf_front.h"

#include <algorithm>

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
        if (border.sampled[s]) border.levels[s] = residency_.topology().depths().of(leaf).sides[s];
        for (const uint32_t other : residency_.topology().leaf_neighbours().around(leaf, s))
            border.corner_sampled[s] =
                border.corner_sampled[s] || !draws(residency_.topology().page_of_leaf(other), slack);
    }
    return border;
}

bool LeafFront::has_arrived(uint32_t page, const LeafBorder& border, Slack& slack) const {
    const auto has = [&](uint32_t of) {
        return wanted_.has_arrived(texel_of(residency_.about().leaves[residency_.topology().leaf(of)]), slack);
    };
    if (forced_) return true;
    if (!has(page)) return false;
    for (uint32_t s = 0; s < 4; ++s) {
        const uint32_t across = residency_.neighbour(page, s);
        if (across != ~0u && !border.sampled[s] && !has(across)) return false;
    }
    return true;
}

uint32_t LeafFront::beside_wanted(uint32_t page, Slack& slack) const {
    const PageTopology& topology = residency_.topology();
    const uint32_t square = topology.square(page);
    if (forced_ || square == ~0u || !is_wanted(topology.leaf_demands().of_square(square), slack)) return 0;
    const std::vector<Leaf>& leaves = residency_.about().leaves;
    const bool own = is_wanted(leaves[square], slack);
    uint32_t bits = 0;
    for (uint32_t k = 0; k < 4; ++k) {
        const uint32_t across = residency_.neighbour(page, k);
        if (own || (across != ~0u && is_wanted(leaves[topology.square(across)], slack))) bits |= 1u << k;
        const auto around = topology.leaf_neighbours().around(square, k);
        if (std::ranges::any_of(around, [&](uint32_t other) { return is_wanted(leaves[other], slack); }))
            bits |= 16u << k;
    }
    return bits;
}

bool LeafFront::ask_for_corner(uint32_t chart, uint32_t x, uint32_t y, Slack& slack) const {
    return !forced_ && residency_.topology().leaf_parts() > 0 &&
           is_wanted(residency_.topology().leaf_demands().of_corner(chart, x, y), slack);
}

}  // namespace lodestone::vgi
