#include "vgi/asset/leaves/leaf_demands.h"

#include <algorithm>
#include <bit>
#include <glm/geometric.hpp>
#include <map>

#include "vgi/asset/bintree.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

LeafNeighbours::LeafNeighbours(const Atlas& about) : corner_(leaf_corners(about)), first_(corner_.size() + 1, 0) {
    for (const uint32_t corner : corner_) ++first_[corner + 1];
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    around_.resize(corner_.size());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t i = 0; i < corner_.size(); ++i) around_[next[corner_[i]]++] = i / 4;
}

namespace {

// Errors and spheres that grow to hold others.
class Demands {
public:
    explicit Demands(const Atlas& about) : about_(about), codes_(about.extent()) {}
    // Whatever is wanted for the one is for the other.
    void add(Leaf& to, const Leaf& one) const {
        if (one.error == 0) return;
        const double away = glm::distance(about_.lattice_point(to.position), about_.lattice_point(one.position));
        to.error = std::max(to.error, one.error);
        to.radius = std::max(
            to.radius, codes_.of_radius((static_cast<double>(codes_.radius(one.radius)) + away) * (1 + rounding)));
    }

private:
    const Atlas& about_;
    const ErrorCodes codes_;
};

// The square that has a corner of a chart's squares, and which of the square's it is.
struct SquareCorner {
    uint32_t leaf, k;
};
SquareCorner at_corner(const Atlas& about, uint32_t chart, GridPoint p) {
    const auto last = static_cast<int32_t>(about.leaves_per_side(chart)) - 1;
    const int32_t x = std::min(p.x, last), y = std::min(p.y, last);
    const uint32_t k = p.y == y ? (p.x == x ? 0 : 1) : (p.x == x ? 3 : 2);
    return {about.leaf(chart, static_cast<uint32_t>(x), static_cast<uint32_t>(y)), k};
}

// Of corners, by their number: what the squares around them ask for, then, upwards in the bintree, what others do.
std::vector<Leaf> corner_demands(const Atlas& about, const LeafNeighbours& neighbours,
                                 const std::vector<Leaf>& squares) {
    const Demands demands(about);
    std::vector<Leaf> corners(4 * squares.size());
    uint32_t most = 1;
    for (uint32_t c = 0; c < about.charts(); ++c) most = std::max(most, about.leaves_per_side(c));
    for (uint32_t depth = 0; depth < Bintree{static_cast<int32_t>(most)}.depths(); ++depth) {
        for (uint32_t c = 0; c < about.charts(); ++c) {
            const Bintree tree{static_cast<int32_t>(about.leaves_per_side(c))};
            if (depth >= tree.depths()) continue;
            tree.for_depth(depth, [&](GridPoint p) {
                const SquareCorner at = at_corner(about, c, p);
                const uint32_t number = neighbours.corner(at.leaf, at.k);
                Leaf& own = corners[number];
                own.position = about.leaves[number / 4].position;
                for (const uint32_t square : neighbours.around(at.leaf, at.k)) demands.add(own, squares[square]);
                tree.for_children(p, [&](GridPoint q) {
                    const SquareCorner child = at_corner(about, c, q);
                    demands.add(own, corners[neighbours.corner(child.leaf, child.k)]);
                });
            });
        }
    }
    return corners;
}

}  // namespace

LeafDemands::LeafDemands(const Atlas& about, const LeafNeighbours& neighbours) : squares_(about.leaves.size()) {
    const Demands demands(about);
    for (uint32_t leaf = 0; leaf < squares_.size(); ++leaf) {
        squares_[leaf].position = about.leaves[leaf].position;
        for (uint32_t k = 0; k < 4; ++k) {
            for (const uint32_t other : neighbours.around(leaf, k)) demands.add(squares_[leaf], about.leaves[other]);
        }
    }
    const std::vector<Leaf> corners = corner_demands(about, neighbours, squares_);
    for (uint32_t c = 0; c < about.charts(); ++c) {
        const uint32_t n = about.leaves_per_side(c);
        per_side_.push_back(n);
        first_corner_.push_back(static_cast<uint32_t>(corners_.size()));
        for (uint32_t i = 0; i < (n + 1) * (n + 1); ++i) {
            const GridPoint p{static_cast<int32_t>(i % (n + 1)), static_cast<int32_t>(i / (n + 1))};
            const SquareCorner at = at_corner(about, c, p);
            const bool own_corner = Bintree{static_cast<int32_t>(n)}.is_corner(p);
            corners_.push_back(own_corner ? Leaf{} : corners[neighbours.corner(at.leaf, at.k)]);
        }
    }
}

const Leaf& LeafDemands::of_chart(const Atlas& about, uint32_t chart) const {
    const uint32_t half = per_side_[chart] / 2;
    return half == 0 ? squares_[about.first_leaf[chart]] : of_corner(chart, half, half);
}

std::vector<uint8_t> samples_beside_leaves(uint32_t cells, const SquareDepths& depths) {
    const auto n = static_cast<int32_t>(cells);
    const Bintree tree{n};
    std::vector<uint8_t> bits(size_t{cells + 1} * (cells + 1), 0);
    const auto at = [&](GridPoint p) -> uint8_t& {
        return bits[static_cast<size_t>(p.y) * (cells + 1) + static_cast<size_t>(p.x)];
    };
    // Above the samples of a side across the corner there are these of the next one.
    const auto is_above = [&](int32_t from_corner, uint32_t corner) {
        return std::has_single_bit(static_cast<uint32_t>(from_corner)) && from_corner >> depths.corners[corner] > 1;
    };
    for (uint32_t side = 0; side < 4; ++side) {
        const int32_t step = 1 << depths.sides[side];
        for (int32_t k = step; k < n; k += step) {
            const auto [x, y] = on_side(side, k, n);
            at({x, y}) |= static_cast<uint8_t>(1u << side);
            if (is_above(k, side)) at({x, y}) |= static_cast<uint8_t>(16u << side);
            if (is_above(n - k, (side + 1) % 4)) at({x, y}) |= static_cast<uint8_t>(16u << (side + 1) % 4);
        }
    }
    for (uint32_t depth = 0; depth < tree.depths(); ++depth) {
        tree.for_depth(depth, [&](GridPoint p) { tree.for_parents(p, [&](GridPoint q) { at(q) |= at(p); }); });
    }
    return bits;
}

SamplesBesideLeaves::SamplesBesideLeaves(const Atlas& about, const SampleDepths& depths)
    : row_(tree_of(about, Layer::geometry).samples_per_side()) {
    std::map<SquareDepths, uint16_t> known{{SquareDepths{}, uint16_t{0}}};
    tables_.push_back(samples_beside_leaves(row_ - 1, {}));
    if (depths.all_are_there()) return;
    for (uint32_t leaf = 0; leaf < about.first_leaf.back(); ++leaf) {
        const auto [at, fresh] = known.try_emplace(depths.of(leaf), static_cast<uint16_t>(tables_.size()));
        if (fresh) tables_.push_back(samples_beside_leaves(row_ - 1, at->first));
        of_square_.push_back(at->second);
    }
}

}  // namespace lodestone::vgi
