// All pages of one chart, for tests of what codes them.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/asset/page_means.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// Pages of a square image, whose finest are given: value(channel, x, y).
template <class Value>
std::vector<Page> pages_of(const PageTree& tree, std::span<const Channel> channels, Value&& value) {
    const uint32_t n = tree.cells_per_page(), row = n + 1;
    std::vector<Page> pages(tree.pages());
    for (uint32_t p = tree.page(0, 0, 0); p < tree.pages(); ++p) {
        uint32_t level = 0, px = 0, py = 0;
        tree.place(p, &level, &px, &py);
        for (uint32_t c = 0; c < channels.size(); ++c) {
            for (uint32_t i = 0; i < row * row; ++i)
                pages[p].values.push_back(static_cast<uint16_t>(value(c, px * n + i % row, py * n + i / row)));
        }
    }
    make_parents(tree, channels, pages);
    return pages;
}

// Neighbours agree about what they share. Pages of 32 cells.
inline void expect_neighbours_agree(const PageTree& tree, const std::vector<Page>& pages) {
    for (uint32_t level = 0; level < tree.base_level(); ++level) {
        for (uint32_t py = 0; py < tree.pages_per_side(level); ++py) {
            for (uint32_t px = 0; px + 1 < tree.pages_per_side(level); ++px) {
                const auto &left = pages[tree.page(level, px, py)].values,
                           &right = pages[tree.page(level, px + 1, py)].values;
                for (size_t i = 0; i < left.size(); i += 33) ASSERT_EQ(left[i + 32], right[i]);
            }
        }
    }
}

}  // namespace lodestone::vgi
