// Channels that may lose something (Channel::step), of the pages of a family, taken as one image: what the parent does
// not tell is transformed block by block, divided by the step, rounded, and goes through a range coder. Integers
// alone: it is decoded to the same numbers on every machine.
//
//   Burt, Adelson, "The Laplacian pyramid as a compact image code", 1983; Wallace, "The JPEG still picture compression
//   standard", 1991; Malvar, Sullivan, "YCoCg-R", 2003.
//
// Samples on the image's border are coded apart from all others, each by itself, as what the parent's border does not
// tell: what is one place in two families or two charts, and has equal numbers there, is decoded to equal numbers. Of
// a chart's coarsest page, which has no parent, those in the middle between two that are known are what these do not
// tell, from the corners on, and all others are what a Coons patch of the border does not tell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "vgi/asset/codec/block_transform.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

class LossyFamily {
public:
    LossyFamily(const PageTree& tree, std::span<const Channel> channels, uint32_t family);

    // Whether any channel may lose something.
    bool empty() const { return groups_.empty(); }
    // Takes what pages of the family have. pages: all of the chart, by number. parent: as it will be decoded.
    void take(std::span<const Page> pages, const Page* parent);
    // Appends what was taken.
    void encode(std::vector<std::byte>& bytes) const;
    // Whether the bytes were those of such a family, from the first to the last.
    bool decode(std::span<const std::byte> bytes);
    // Sets the channels of a page. member: 0 .. 3, 0 of the coarsest page.
    void put(uint32_t member, const Page* parent, Page& samples) const;

private:
    // One channel, or the three of a colour, which are coded as brightness and two differences.
    struct Group {
        size_t channel;
        uint32_t count;                // 1 or 3
        uint32_t kind;                 // groups whose numbers have like statistics have equal kinds; even
        bool follows;                  // a group of the same kind
        std::array<int32_t, 3> steps;  // sixteenths
        int32_t low, high;             // of numbers
        size_t component;              // its first
    };
    // Numbers of one of a group's components, divided by the step.
    struct Component {
        std::vector<int16_t> border;  // counter-clockwise, 4 * side_
        std::vector<int16_t> blocks;  // row by row, 64 each
    };
    // A square of the image, with samples of all channels of a group.
    struct Part {
        Part(uint32_t left, uint32_t top, uint32_t across, uint32_t channels) : x(left), y(top), cells(across) {
            for (uint32_t k = 0; k < channels; ++k) values[k].resize(size_t{cells + 1} * (cells + 1));
        }
        uint32_t x, y, cells;
        std::array<std::vector<int32_t>, 3> values;
        size_t at(uint32_t px, uint32_t py) const { return size_t{py - y} * (cells + 1) + (px - x); }
    };
    using Numbers = std::array<int32_t, 3>;

    bool is_base() const { return family_ == 0; }
    uint32_t blocks_per_side() const { return (side_ + block_side - 1) / block_side; }
    bool on_border(uint32_t x, uint32_t y) const { return x == 0 || y == 0 || x == side_ || y == side_; }
    size_t border_number(uint32_t x, uint32_t y) const;
    Part part_of(const Group& group, uint32_t member) const;
    void expect(const Group& group, const Page* parent, Part& part) const;
    void expect_inside(const Group& group, Part& part) const;
    template <class Visit>
    void along_base_border(const Group& group, Part& part, Visit&& visit) const;
    // Corners of the coarsest page, from which all else follows, are exact: what is flat stays what it is.
    int32_t border_step(const Group& group, uint32_t k, uint32_t x, uint32_t y) const {
        const bool exact = is_base() && (x == 0 || x == side_) && (y == 0 || y == side_);
        return exact ? 16 : group.steps[k];
    }
    Numbers border_residual(const Group& group, uint32_t x, uint32_t y) const;
    static void add(const Group& group, const Numbers& residual, Part& part, size_t at);
    void add_border(const Group& group, Part& part) const;
    bool block_residual(const Group& group, uint32_t k, size_t block, Block& residual) const;
    void add_blocks(const Group& group, Part& part) const;
    void take_border(const Group& group, const Part& original, Part& part);
    void take_blocks(const Group& group, const Part& original, const Part& expected);
    Part original_of(const Group& group, std::span<const Page> pages) const;
    template <class Coder>
    void code(Coder& coder, std::vector<Component>& components) const;

    PageTree tree_;
    uint32_t family_, side_;  // cells of the image
    std::vector<Group> groups_;
    std::vector<Component> components_;
};

}  // namespace lodestone::vgi
