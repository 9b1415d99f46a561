#include "vgi/residency.h"

#include <string>
#include <utility>

#include "base/check.h"

namespace lodestone::vgi {

GeometryPage packed_geometry(const Page& page, const PageTree& tree) {
    const size_t count = size_t{tree.samples_per_side()} * tree.samples_per_side();
    LODE_CHECK(page.values.size() == 5 * count, page.values.size());
    GeometryPage packed(count);
    for (size_t i = 0; i < count; ++i) {
        packed[i] = {page.values[i], page.values[count + i], page.values[2 * count + i],
                     static_cast<uint8_t>(page.values[3 * count + i]),
                     static_cast<uint8_t>(page.values[4 * count + i])};
    }
    return packed;
}

Page unpacked_geometry(const GeometryPage& page) {
    const size_t count = page.size();
    Page plain;
    plain.values.resize(5 * count);
    for (size_t i = 0; i < count; ++i) {
        plain.values[i] = page[i].x;
        plain.values[count + i] = page[i].y;
        plain.values[2 * count + i] = page[i].z;
        plain.values[3 * count + i] = page[i].error;
        plain.values[4 * count + i] = page[i].radius;
    }
    return plain;
}

Residency::Residency(const Atlas& about) : about_(&about), tree_{about.cells} {
    entries_.resize(size_t{about.charts()} * tree_.pages());
    neighbours_.resize(entries_.size());
    for (uint32_t chart = 0; chart < about.charts(); ++chart) {
        for (uint32_t page = 0; page < tree_.pages(); ++page) {
            uint32_t level = 0, x = 0, y = 0;
            tree_.place(page, &level, &x, &y);
            const uint32_t n = tree_.pages_per_side(level), last = n - 1;
            for (uint32_t side = 0; side < 4; ++side) {
                uint32_t& across = neighbours_[number(chart, page)][side];
                const bool inside = side == 0 ? y > 0 : side == 1 ? x < last : side == 2 ? y < last : x > 0;
                if (inside) {
                    across = number(chart, tree_.page(level,
                                                      side == 1   ? x + 1
                                                      : side == 3 ? x - 1
                                                                  : x,
                                                      side == 2   ? y + 1
                                                      : side == 0 ? y - 1
                                                                  : y));
                    continue;
                }
                const GluedSide& other = about.sides[size_t{chart} * 4 + side];
                if (other.chart == ~0u) {
                    across = ~0u;
                    continue;
                }
                // Step k of one side is step last - k of the other, counted in pages.
                const uint32_t step = side == 0 ? x : side == 1 ? y : side == 2 ? last - x : last - y;
                const auto [u, v] = on_side(other.side, last - step, last);
                across = number(other.chart, tree_.page(level, u, v));
            }
        }
    }
}

void Residency::put(uint32_t number, std::shared_ptr<const GeometryPage> texels, uint32_t slot) {
    LODE_CHECK(texels != nullptr && entries_[number].texels == nullptr, number);
    entries_[number].first = texels->data();
    entries_[number].texels = std::move(texels);
    entries_[number].slot = slot;
    changed_ = true;
}

void Residency::drop(uint32_t number) {
    LODE_CHECK(entries_[number].texels != nullptr, number);
    entries_[number] = {};
    changed_ = true;
}

uint32_t Residency::neighbour(uint32_t number, uint32_t side) const { return neighbours_[number][side]; }

bool Residency::usable_by_definition(uint32_t number) const {
    if (entries_[number].texels == nullptr) return false;
    const uint32_t per_chart = tree_.pages(), page = number % per_chart, chart = number / per_chart;
    if (page == 0) return true;
    uint32_t level = 0, x = 0, y = 0;
    tree_.place(page, &level, &x, &y);
    const uint32_t parent = chart * per_chart + tree_.parent(page);
    if (!usable(parent)) return false;
    for (const uint32_t side : {y % 2 == 0 ? 0u : 2u, x % 2 == 0 ? 3u : 1u}) {
        const uint32_t across = neighbours_[parent][side];
        if (across != ~0u && !usable(across)) return false;
    }
    return true;
}

void Residency::update() {
    if (!std::exchange(changed_, false)) return;
    const uint32_t per_chart = tree_.pages();
    // Coarse levels first: parents come before their children.
    for (uint32_t page = 0; page < per_chart; ++page) {
        for (uint32_t number = page; number < entries_.size(); number += per_chart)
            entries_[number].usable = usable_by_definition(number) ? 1 : 0;
    }
    for (uint32_t number = 0; number < entries_.size(); ++number) {
        if ((entries_[number].usable & 1) == 0) continue;
        for (uint32_t side = 0; side < 4; ++side) {
            const uint32_t across = neighbours_[number][side];
            if (across == ~0u || usable(across)) entries_[number].usable |= static_cast<uint8_t>(2u << side);
        }
    }
}

Result<void> Residency::validate() const {
    for (uint32_t number = 0; number < entries_.size(); ++number) {
        const std::string place = "residency: page " + std::to_string(number);
        if (!changed_ && usable(number) != usable_by_definition(number))
            return fail(Fault::invariant, place + ": is stale");
        for (uint32_t side = 0; side < 4; ++side) {
            const uint32_t across = neighbours_[number][side];
            if (across == ~0u) continue;
            uint32_t back = 0;
            while (back < 4 && neighbours_[across][back] != number) ++back;
            if (back == 4) return fail(Fault::invariant, place + ": is not its neighbour's neighbour");
        }
    }
    return {};
}

}  // namespace lodestone::vgi
