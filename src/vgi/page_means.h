// Coarser pages of averaged channels: means of what is around a sample, by the weights 1 4 1 across and down, instead
// of the sample. Along a page's border they are of the border alone, and in its corners the sample stays: pages and
// charts that share them agree.
#pragma once

#include <span>

#include "vgi/pages.h"

namespace lodestone::vgi {

// The parent of four pages, in the order of PageTree::member; of channels that are not averaged it has every second
// sample.
Page parent_of(const PageTree& tree, std::span<const Channel> channels, std::span<const Page, 4> children);

}  // namespace lodestone::vgi
