// The images of an atlas as pages: what is read, decoded and cached as one. A page is 32 x 32 cells of one chart at one
// level, its outer samples included (fewer where the chart has fewer cells), and every page but a chart's coarsest is
// coded as what its parent page cannot tell: samples the parent has are left out, the others are differences from the
// mean of the parent's nearest.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/atlas.h"

namespace lodestone::vgi {

inline constexpr uint32_t page_cells = 32;

// Pages of a chart, coarsest level first, row by row within a level.
struct PageTree {
    uint32_t cells;  // of the chart

    uint32_t cells_per_page() const { return cells < page_cells ? cells : page_cells; }
    // Level of the coarsest pages: one per chart; coarser levels are samples of these.
    uint32_t base_level() const;
    uint32_t pages_per_side(uint32_t level) const { return (cells >> level) / cells_per_page(); }
    uint32_t pages() const;                                       // of all levels
    uint32_t page(uint32_t level, uint32_t x, uint32_t y) const;  // its number
    void place(uint32_t page, uint32_t* level, uint32_t* x, uint32_t* y) const;
};

// Compresses one page of one chart (zstd). Deterministic.
std::vector<std::byte> encode_page(const Atlas& atlas, uint32_t chart, uint32_t page);
// Fills the page's texels; the parent's must be there. Fault::format where the bytes are not those of such a page.
Result<void> decode_page(Atlas& atlas, uint32_t chart, uint32_t page, std::span<const std::byte> bytes);

}  // namespace lodestone::vgi
