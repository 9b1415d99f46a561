// What leaves that are drawn ask of the samples around them: those on their sides, and all above these in the bintree,
// within a chart and across its borders. They are not among what a sample's own error says (saturation.h): where no
// leaf is wanted, nothing is asked.
//
// In the square of a finest page it is told by its sides and corners: which of them a leaf that is wanted touches. The
// corners of squares are told one by one: each has a sphere and an error, wanted as leaves are, that are wanted
// wherever a leaf is which asks for it. Corners that are glued have the same.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/sample_depths.h"

namespace lodestone::vgi {

// Which squares of leaves meet where.
class LeafNeighbours {
public:
    LeafNeighbours() = default;
    explicit LeafNeighbours(const Atlas& about);

    // The squares that meet in corner k of a square, itself included.
    std::span<const uint32_t> around(uint32_t leaf, uint32_t k) const {
        const uint32_t c = corner_[4 * leaf + k];
        return std::span(around_).subspan(first_[c], first_[c + 1] - first_[c]);
    }
    // A number that corners which are one share; 0 .. 4 squares - 1.
    uint32_t corner(uint32_t leaf, uint32_t k) const { return corner_[4 * leaf + k]; }

private:
    std::vector<uint32_t> corner_;          // 4 leaf + k
    std::vector<uint32_t> around_, first_;  // squares by corner; per corner, and the end
};

class LeafDemands {
public:
    LeafDemands() = default;
    // about: of which only the description and the leaves are looked at.
    LeafDemands(const Atlas& about, const LeafNeighbours& neighbours);

    // Wanted wherever some leaf is whose square touches this one, itself included. Of a Leaf's members position, error
    // and radius count.
    const Leaf& of_square(uint32_t leaf) const { return squares_[leaf]; }
    // Of corner (x, y) of a chart's squares, 0 .. Atlas::leaves_per_side(): wanted wherever leaves ask for the sample
    // there. Those of the chart's own corners ask for nothing.
    const Leaf& of_corner(uint32_t chart, uint32_t x, uint32_t y) const {
        return corners_[first_corner_[chart] + y * (per_side_[chart] + 1) + x];
    }
    // Wanted wherever leaves ask for anything in a chart.
    const Leaf& of_chart(const Atlas& about, uint32_t chart) const;

private:
    std::vector<Leaf> squares_, corners_;
    std::vector<uint32_t> first_corner_, per_side_;  // per chart
};

// The samples of a square that are asked for where a leaf which is wanted touches its side k (bit k) or its corner k
// (bit 4 + k), row by row. A side counts with both its corners. cells: of a page.
std::vector<uint8_t> samples_beside_leaves(uint32_t cells, const SquareDepths& depths);

// The same of all squares: they have few different depths.
class SamplesBesideLeaves {
public:
    SamplesBesideLeaves() = default;
    // about: as LeafDemands has it; depths: its.
    SamplesBesideLeaves(const Atlas& about, const SampleDepths& depths);
    // x, y: 0 .. cells of a page.
    uint8_t at(uint32_t leaf, uint32_t x, uint32_t y) const {
        return tables_[of_square_.empty() ? 0 : of_square_[leaf]][y * row_ + x];
    }

private:
    uint32_t row_ = 0;
    std::vector<std::vector<uint8_t>> tables_;
    std::vector<uint16_t> of_square_;  // into tables_; empty where all are the first
};

}  // namespace lodestone::vgi
