// Pages of charts that end before their finest level (sample_depths.h): what is coded of them are samples of their own,
// every so manieth one each way. The others lie between these.
#pragma once

#include <span>

#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// Every stride-th sample of a page.
Page sampled_part(const PageTree& tree, std::span<const Channel> channels, const Page& page, uint32_t stride);
// The inverse: the samples between are as fill_unsampled() has them.
Page spread_samples(const PageTree& tree, std::span<const Channel> channels, const Page& sampled, uint32_t stride);
// Puts between every stride-th sample what lies between them in the bintree: the middle of amounts and directions, one
// of two names, and errors and radii of what is not there.
void fill_unsampled(const PageTree& tree, std::span<const Channel> channels, uint32_t stride, Page& page);

}  // namespace lodestone::vgi
