#include "vgi/extract/chart_places.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "vgi/asset/pages.h"

namespace lodestone::vgi {

namespace {

constexpr uint32_t texels_in_step = 4;  // sides are multiples: what devices compress are blocks of so many

// Calls place(chart, x, y) for squares in rows, largest first; returns the height of all rows.
template <class Place>
uint32_t in_rows(const std::vector<uint32_t>& order, const std::vector<uint32_t>& cells, uint32_t width,
                 const Place& place) {
    uint32_t x = 0, y = 0, row = 0;
    for (const uint32_t chart : order) {
        const uint32_t side = cells[chart] + 1 + ChartPlaces::gutter;
        if (x + side > width) {
            x = 0;
            y += row;
            row = 0;
        }
        place(chart, x, y);
        x += side;
        row = std::max(row, side);
    }
    return y + row;
}

}  // namespace

ChartPlaces::ChartPlaces(const Atlas& atlas, uint32_t levels_left_out) : shift_(levels_left_out) {
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const PageTree tree = tree_of(atlas, Layer::attributes, c);
        own_levels_.push_back(std::min(levels_left_out, tree.base_level()));
        cells_.push_back(tree.cells >> own_levels_.back());
    }
    order_.resize(cells_.size());
    std::iota(order_.begin(), order_.end(), 0u);
    std::ranges::stable_sort(order_, std::greater<>(), [&](uint32_t c) { return cells_[c]; });
    const uint32_t largest = cells_.empty() ? 1 : cells_[order_[0]] + 1 + gutter;
    // The first width at which rows are not higher than wide.
    uint32_t low = largest, high = largest;
    while (height_at(high) > high) {
        low = high;
        high *= 2;
    }
    for (uint32_t width = low; width <= high; width += std::max(1u, low / 256)) {
        if (height_at(width) > width) continue;
        lay_out(width);
        return;
    }
    lay_out(high);
}

uint32_t ChartPlaces::height_at(uint32_t width) const {
    return in_rows(order_, cells_, width, [](uint32_t, uint32_t, uint32_t) {});
}

void ChartPlaces::lay_out(uint32_t width) {
    corners_.resize(cells_.size());
    const uint32_t height = in_rows(order_, cells_, width, [&](uint32_t chart, uint32_t x, uint32_t y) {
        corners_[chart] = glm::uvec2(x, y) + gutter / 2;
    });
    const auto rounded_up = [](uint32_t side) { return (side + texels_in_step - 1) / texels_in_step * texels_in_step; };
    texels_ = {rounded_up(width), rounded_up(height)};
}

Result<ChartPlaces> ChartPlaces::fit(const Atlas& atlas, uint32_t most_texels) {
    const uint32_t most_levels = tree_of(atlas, Layer::attributes).base_level();
    for (uint32_t level = 0;; ++level) {
        ChartPlaces places(atlas, level);
        const uint32_t side = std::max(places.texels_.x, places.texels_.y);
        if (side <= most_texels) return places;
        if (level >= most_levels)
            return fail(Fault::usage, std::to_string(most_texels) + ": charts need at least " + std::to_string(side) +
                                          " texels a side");
    }
}

}  // namespace lodestone::vgi
