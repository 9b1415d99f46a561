// Coarser pages of averaged channels: means of what is around a sample instead of the sample. A mean is the sample plus
// a share of what its neighbours differ by from what is expected of them. Those differences are what is stored of the
// finer page, so whoever has them and the mean has the sample, and means take no more room than samples do.
//
//   Calderbank, Daubechies, Sweldens, Yeo, "Wavelet transforms that map integers to integers", 1998 (the update step of
//   the 5/3 transform, here over the square).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/pages.h"

namespace lodestone::vgi {

// Differences of one channel of a page from what is expected; 0 where the parent has the sample.
class PageDifferences {
public:
    explicit PageDifferences(int32_t cells) : n_(cells), values_(static_cast<size_t>(n_ + 1) * (cells + 1), 0) {}
    int8_t& at(int32_t x, int32_t y) { return values_[static_cast<size_t>(y * (n_ + 1) + x)]; }
    int32_t at(int32_t x, int32_t y) const { return values_[static_cast<size_t>(y * (n_ + 1) + x)]; }
    // What makes a mean of the sample at (x, y), both even. On a page's border it is of the border alone, and nothing
    // in its corners: pages that share them agree.
    int32_t to_mean(int32_t x, int32_t y) const;

private:
    int32_t n_;
    std::vector<int8_t> values_;
};

// Of an averaged channel's samples that the parent has, row by row: whether the parent has the sample instead of the
// mean, 0 or 1. For all channels of the group alike.
using KeptSamples = std::vector<uint8_t>;

// The parent of four pages, in the order of PageTree::member. A sample is kept where its mean does not fit the channel,
// or points farther away from the directions around it, as it may across the folds of the octahedral map.
Page parent_of(const PageTree& tree, std::span<const Channel> channels, std::span<const Page, 4> children);
// Of the group that begins with a channel: which of its samples the parent has kept.
KeptSamples kept_samples(const PageTree& tree, std::span<const Channel> channels, size_t first, uint32_t page,
                         const Page& samples, const Page& parent);
// Makes samples of the means that a channel of a page has where its parent has them.
void take_means_back(std::span<const Channel> channels, size_t channel, const PageDifferences& differences,
                     std::span<const uint8_t> kept, int32_t cells, Page& page);

}  // namespace lodestone::vgi
