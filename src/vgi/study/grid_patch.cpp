#include "vgi/study/grid_patch.h"

#include <algorithm>
#include <array>
#include <bit>

namespace lodestone::vgi {

uint32_t GridPatch::triangles() const {
    uint32_t count = 2 * cells() * cells();
    for (const uint32_t d : coarser) count -= cells() - (cells() >> d);
    return count;
}

void GridPatch::append_words(std::vector<uint32_t>& to) const {
    uint32_t shape = level | cell_shift << 4 | views << LODE_VGI_PATCH_VIEWS;
    for (uint32_t side = 0; side < 4; ++side) shape |= coarser[side] << (8 + 2 * side);
    to.push_back(shape);
    to.push_back(x | y << 16);
    to.insert(to.end(), slots.begin(), slots.end());
}

GridPatch GridPatch::of_words(std::span<const uint32_t> words) {
    GridPatch patch;
    patch.level = words[0] & 15;
    patch.cell_shift = words[0] >> 4 & 3;
    patch.views = words[0] >> LODE_VGI_PATCH_VIEWS & 255;
    for (uint32_t side = 0; side < 4; ++side) patch.coarser[side] = words[0] >> (8 + 2 * side) & 3;
    patch.x = words[1] & 0xffff;
    patch.y = words[1] >> 16;
    std::copy_n(words.begin() + 2, patch.slots.size(), patch.slots.begin());
    return patch;
}

void GridPatch::append_indices(uint32_t chart_cells, uint32_t cells_per_page, std::vector<uint32_t>& to) const {
    const auto page_shift = static_cast<uint32_t>(std::countr_zero(cells_per_page));
    const uint32_t base = static_cast<uint32_t>(std::countr_zero(chart_cells)) - page_shift,
                   first = std::min(level, base);
    // From the page of the sample's own level, as everybody reads it: it moves alike for all.
    const auto index = [&](GridPoint p) {
        const uint32_t at_x = x + (static_cast<uint32_t>(p.x) << level),
                       at_y = y + (static_cast<uint32_t>(p.y) << level);
        const auto own = static_cast<uint32_t>(std::countr_zero(at_x | at_y | chart_cells));
        const uint32_t page_level = std::clamp(own, first, base), down = page_level + page_shift;
        const uint32_t in_x = (at_x >> page_level) - (x >> down << page_shift),
                       in_y = (at_y >> page_level) - (y >> down << page_shift);
        return slots[page_level - first] * LODE_VGI_PAGE_TEXELS(cells_per_page) + in_y * (cells_per_page + 1) + in_x;
    };
    const auto n = static_cast<int32_t>(cells());
    std::array<uint32_t, 81> vertex;
    for (GridPoint p; p.y <= n; ++p.y) {
        for (p.x = 0; p.x <= n; ++p.x) vertex[static_cast<size_t>(p.y * (n + 1) + p.x)] = index(p);
    }
    const auto at = [&](GridPoint p) { return vertex[static_cast<size_t>(p.y * (n + 1) + p.x)]; };
    // All at once: a list that grows by three words each time takes a sixth of a cut.
    std::array<uint32_t, size_t{6} * 8 * 8> indices;
    size_t count = 0;
    for_node_triangles(n, coarser, [&](GridPoint a, GridPoint b, GridPoint c) {
        for (const GridPoint p : {a, b, c}) indices[count++] = at(p);
    });
    to.insert(to.end(), indices.begin(), indices.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace lodestone::vgi
