#include "vgi/asset/sample_depths.h"

#include <algorithm>
#include <utility>

#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

namespace {

using Squares = std::vector<SquareDepths>;

// Both squares that have a side have it alike.
void set_side(const Atlas& about, const Atlas::Tile& square, uint32_t leaf, uint32_t side, uint8_t level,
              Squares& squares) {
    squares[leaf].sides[side] = level;
    const LeafSide other = leaf_across(about, square, side);
    if (other.leaf != ~0u) squares[other.leaf].sides[other.side] = level;
}

// Calls visit(square, its number) for all squares of all charts.
template <class Visit>
void for_all_squares(const Atlas& about, Visit&& visit) {
    for (uint32_t c = 0; c < about.charts(); ++c) for_leaf_squares(about, c, visit);
}

}  // namespace

SampleDepths::SampleDepths(const Atlas& about) {
    if (std::ranges::all_of(about.unsampled_levels, [](uint8_t levels) { return levels == 0; })) return;
    squares_.resize(about.first_leaf.back());
    for_all_squares(about, [&](const Atlas::Tile& square, uint32_t leaf) {
        const uint8_t own = about.unsampled_levels[square.chart];
        for (uint32_t s = 0; s < 4; ++s) {
            if (own > squares_[leaf].sides[s]) set_side(about, square, leaf, s, own, squares_);
        }
    });
    for (bool changed = true; std::exchange(changed, false);) {
        for_all_squares(about, [&](const Atlas::Tile& square, uint32_t leaf) {
            for (uint32_t s = 0; s < 4; ++s) {
                const uint8_t least = std::max(squares_[leaf].sides[(s + 1) % 4], squares_[leaf].sides[(s + 3) % 4]);
                if (squares_[leaf].sides[s] + 1 >= least) continue;
                set_side(about, square, leaf, s, static_cast<uint8_t>(least - 1), squares_);
                changed = true;
            }
        });
    }
    const std::vector<uint32_t> corner = leaf_corners(about);
    std::vector<uint8_t> finest(corner.size(), 255);
    const auto level_at = [&](uint32_t leaf, uint32_t k) {
        return std::min(squares_[leaf].sides[k], squares_[leaf].sides[(k + 3) % 4]);
    };
    for (uint32_t i = 0; i < corner.size(); ++i)
        finest[corner[i]] = std::min(finest[corner[i]], level_at(i / 4, i % 4));
    for (uint32_t i = 0; i < corner.size(); ++i) squares_[i / 4].corners[i % 4] = finest[corner[i]];
}

bool SampleDepths::is_even(const Atlas& about, uint32_t chart) const {
    if (squares_.empty()) return true;
    bool even = true;
    for_leaf_squares(about, chart, [&](const Atlas::Tile&, uint32_t leaf) {
        for (const uint8_t level : squares_[leaf].sides) even = even && level == about.unsampled_levels[chart];
    });
    return even;
}

std::vector<bool> absent_samples(const Atlas& about, const SampleDepths& depths, uint32_t chart) {
    const uint32_t n = about.cells_of(chart), row = n + 1;
    std::vector<bool> absent(size_t{row} * row, false);
    if (depths.all_are_there()) return absent;
    const uint32_t square = tree_of(about, Layer::geometry, chart).cells_per_page(), last = n / square - 1;
    const uint32_t own = about.unsampled_levels[chart];
    const auto is_on = [](uint32_t at, uint32_t level) { return (at & ((1u << level) - 1)) == 0; };
    const auto leaves_out = [&](uint32_t x, uint32_t y) {
        if (!is_on(x | y, own)) return true;
        const uint32_t sx = std::min(x / square, last), sy = std::min(y / square, last);
        const uint32_t leaf = about.leaf(chart, sx, sy);
        const bool across = x % square != 0, down = y % square != 0;  // from the square's sides
        if (across == down) return false;                             // inside, or a corner
        const uint32_t side = across ? (y == sy * square ? 0 : 2) : (x == sx * square ? 3 : 1);
        return !is_on(across ? x : y, depths.of(leaf).sides[side]);
    };
    const auto number = [&](GridPoint p) { return static_cast<size_t>(p.y) * row + static_cast<size_t>(p.x); };
    const Bintree tree{static_cast<int32_t>(n)};
    for (uint32_t depth = tree.depths(); depth-- > 0;) {
        tree.for_depth(depth, [&](GridPoint p) {
            bool is_absent = leaves_out(static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y));
            tree.for_parents(p, [&](GridPoint q) { is_absent = is_absent || absent[number(q)]; });
            absent[number(p)] = is_absent;
        });
    }
    return absent;
}

void fill_absent_positions(Atlas& atlas, uint32_t chart, const std::vector<bool>& absent) {
    const Bintree tree{static_cast<int32_t>(atlas.cells_of(chart))};
    const auto at = [&](GridPoint p) {
        return atlas.texel(chart, static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y));
    };
    const size_t first = atlas.texel(chart, 0, 0);
    for (uint32_t depth = tree.depths(); depth-- > 0;) {
        tree.for_depth(depth, [&](GridPoint p) {
            const size_t texel = at(p);
            if (!absent[texel - first]) return;
            const auto ends = tree.hypotenuse(p);
            const auto &a = atlas.positions[at(ends[0])], &b = atlas.positions[at(ends[1])];
            for (size_t k = 0; k < 3; ++k)
                atlas.positions[texel][k] = static_cast<uint16_t>((uint32_t{a[k]} + b[k] + 1) / 2);
        });
    }
}

}  // namespace lodestone::vgi
