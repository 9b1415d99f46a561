// How deep charts are sampled. A chart has samples of its own as finely as the source has triangles there, and no
// finer: below that its leaves (leaves.h) are what is drawn. Charts that are glued may end at different depths. Then,
// on their common side, only samples are there that both have; samples whose parents in the bintree are not there are
// not either; and so that no other side is touched by that, sides of a square that meet in a corner differ by one level
// at most, the coarser one having its way.
//
// What is not there is never drawn: its error is 0, its radius ErrorCodes::absent, and so are those of its children.
// Its place in the images holds what is drawn there, the middle of the hypotenuse that it would halve.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/bintree.h"

namespace lodestone::vgi {

// Of a square of leaves: log2 of how many cells the samples of a side are apart that are there; and by corner the least
// of all sides that meet there.
struct SquareDepths {
    std::array<uint8_t, 4> sides{}, corners{};
    auto operator<=>(const SquareDepths&) const = default;
};

// Which samples lie on the sides of squares of leaves.
class SampleDepths {
public:
    SampleDepths() = default;
    // about: laid out and glued; no image is looked at.
    explicit SampleDepths(const Atlas& about);

    // Whether all samples of all charts are there.
    bool all_are_there() const { return squares_.empty(); }
    // Of a square, into Atlas::leaves.
    SquareDepths of(uint32_t leaf) const { return squares_.empty() ? SquareDepths{} : squares_[leaf]; }
    // Whether no side in a chart is coarser than the chart.
    bool is_even(const Atlas& about, uint32_t chart) const;

private:
    std::vector<SquareDepths> squares_;  // empty where all are 0
};

// Which samples of a chart are not there, row by row. about: no image is looked at.
std::vector<bool> absent_samples(const Atlas& about, const SampleDepths& depths, uint32_t chart);

// Puts what is drawn there in the place of a chart's samples that are not there.
void fill_absent_positions(Atlas& atlas, uint32_t chart, const std::vector<bool>& absent);

// Calls visit(a, b, c), counter-clockwise, for the triangles of the bintree of a chart's samples that are there and of
// a level of its own at least. about: no image is looked at.
template <class Visit>
void for_level_triangles(const Atlas& about, const SampleDepths& depths, uint32_t chart, uint32_t own_level,
                         Visit&& visit) {
    const auto n = static_cast<int32_t>(about.cells_of(chart));
    const Bintree tree{n};
    const std::vector<bool> absent = absent_samples(about, depths, chart);
    const auto divides = [&](GridPoint p) {
        return tree.level(p) >= own_level &&
               !absent[static_cast<size_t>(p.y) * (about.cells_of(chart) + 1) + static_cast<size_t>(p.x)];
    };
    // a, b: ends of the hypotenuse.
    const auto halve = [&](const auto& self, GridPoint a, GridPoint b, GridPoint c) -> void {
        const GridPoint m{(a.x + b.x) / 2, (a.y + b.y) / 2};
        if ((a.x + b.x) % 2 != 0 || (a.y + b.y) % 2 != 0 || !divides(m)) {
            visit(a, b, c);
            return;
        }
        self(self, c, a, m);
        self(self, b, c, m);
    };
    halve(halve, {n, n}, {0, 0}, {n, 0});
    halve(halve, {0, 0}, {n, n}, {0, n});
}

}  // namespace lodestone::vgi
