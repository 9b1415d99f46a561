// A node of a grid cut as it is drawn: as a patch for a device to tessellate, or as triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/node_triangles.h"

namespace lodestone::vgi {

struct GridPatch {
    uint32_t level = 0;
    uint32_t cell_shift = 0;                             // log2 of its cells along a side, 0 .. 3
    std::array<uint32_t, 4> coarser{};                   // per side: levels that the node across is coarser, 0 .. 3
    uint32_t x = 0, y = 0;                               // its lowest corner, in cells of the chart's level 0
    uint32_t views = 255;                                // that it is drawn in, a bit each
    std::array<uint32_t, LODE_VGI_PATCH_SLOTS> slots{};  // of the pages it lies in, from that of its level upwards

    uint32_t cells() const { return 1u << cell_shift; }
    // That are not flat.
    uint32_t triangles() const;
    // LODE_VGI_PATCH_WORDS of them.
    void append_words(std::vector<uint32_t>& to) const;
    static GridPatch of_words(std::span<const uint32_t> words);
    // chart_cells, cells_per_page: of the atlas. What shaders/vgi/patch.tese makes of the patch, without flat
    // triangles.
    void append_indices(uint32_t chart_cells, uint32_t cells_per_page, std::vector<uint32_t>& to) const;
};

}  // namespace lodestone::vgi
