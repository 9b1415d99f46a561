#include "vgi/draw/residency.h"

#include <algorithm>
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
    below_.resize(entries_.size());
    changed_at_.resize(entries_.size());
    for (uint32_t i = static_cast<uint32_t>(entries_.size()); i-- > 0;) {
        const PageBounds& bounds = about.bounds[i];
        const auto raise = [](SampleCodes& codes, uint8_t error, uint8_t radius) {
            codes = {std::max(codes.error, error), std::max(codes.radius, radius)};
        };
        raise(below_[i], bounds.sample_error, bounds.sample_radius);
        const uint32_t page = i % tree_.pages();
        if (page > 0) raise(below_[i - page + tree_.parent(page)], below_[i].error, below_[i].radius);
    }
    for (uint32_t chart = 0; chart < about.charts(); ++chart) {
        for (uint32_t page = 0; page < tree_.pages(); ++page) {
            uint32_t level = 0, x = 0, y = 0;
            tree_.place(page, &level, &x, &y);
            for (uint32_t side = 0; side < 4; ++side) {
                const Atlas::Tile to = about.across({chart, x, y}, side, tree_.pages_per_side(level));
                neighbours_[number(chart, page)][side] =
                    to.chart == ~0u ? ~0u : number(to.chart, tree_.page(level, to.x, to.y));
            }
        }
    }
}

void Residency::put(uint32_t number, std::shared_ptr<const GeometryPage> texels, uint32_t slot) {
    LODE_CHECK(texels != nullptr && entries_[number].texels == nullptr, number);
    entries_[number].first = texels->data();
    entries_[number].texels = std::move(texels);
    entries_[number].slot = slot;
    came_or_went_.push_back(number);
}

void Residency::drop(uint32_t number) {
    LODE_CHECK(entries_[number].texels != nullptr, number);
    entries_[number] = {};
    came_or_went_.push_back(number);
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
    if (came_or_went_.empty()) return;
    ++updates_;
    const uint32_t per_chart = tree_.pages();
    std::vector<uint8_t> before;
    for (const Entry& entry : entries_) before.push_back(entry.usable);
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
    for (uint32_t number = 0; number < entries_.size(); ++number) {
        if (entries_[number].usable != before[number]) mark_changed(number);
    }
    for (const uint32_t number : came_or_went_) mark_changed(number);
    came_or_went_.clear();
}

void Residency::mark_changed(uint32_t number) {
    const uint32_t per_chart = tree_.pages();
    const auto mark_up = [&](uint32_t n) {
        for (;;) {
            if (std::exchange(changed_at_[n], updates_) == updates_) return;
            const uint32_t page = n % per_chart;
            if (page == 0) return;
            n = n - page + tree_.parent(page);
        }
    };
    mark_up(number);
    for (const uint32_t across : neighbours_[number]) {
        if (across != ~0u) mark_up(across);
    }
}

Result<void> Residency::validate() const {
    for (uint32_t number = 0; number < entries_.size(); ++number) {
        const std::string place = "residency: page " + std::to_string(number);
        if (came_or_went_.empty() && usable(number) != usable_by_definition(number))
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
