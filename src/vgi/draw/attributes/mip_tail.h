// Levels of a chart's attributes that are coarser than its coarsest page, down to a single cell, for charts so far away
// that a pixel covers many of their samples: means of what is around a sample, across the borders of charts as well, so
// that no border shows. They are made of the coarsest pages, which are always there, and never change.
//
//   Williams, "Pyramidal parametrics", SIGGRAPH 1983, for the levels.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/draw/attributes/attribute_pages.h"

namespace lodestone::vgi {

// Samples that a chart has of them all, whose coarsest page has `cells` a side: a power of two.
uint32_t mip_tail_samples(uint32_t cells);

// All of an atlas, chart after chart: of each, the level of half the page's cells first, as packed_attributes() packs
// them. coarsest: of each chart, in the same form.
AttributePage mip_tail(const Atlas& about, std::span<const std::shared_ptr<const AttributePage>> coarsest,
                       uint32_t texel_words);

// Of its coarsest level, a chart's normals and materials where its sides begin. tail: of mip_tail(). cells: of a
// chart's coarsest page.
std::vector<std::array<uint32_t, 4>> coarsest_corners(const AttributePage& tail, uint32_t charts, uint32_t cells,
                                                      uint32_t texel_words);

}  // namespace lodestone::vgi
