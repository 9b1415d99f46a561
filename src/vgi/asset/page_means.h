// Coarser pages of averaged channels: means of what is around a sample, by the weights 1 4 1 across and down, instead
// of the sample. Along a page's border they are of the border alone, and in its corners the sample stays: pages and
// charts that share them agree.
#pragma once

#include <span>

#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// Makes all pages from those of level 0; of channels that are not averaged they have every second sample.
void make_parents(const PageTree& tree, std::span<const Channel> channels, std::span<Page> pages);

}  // namespace lodestone::vgi
