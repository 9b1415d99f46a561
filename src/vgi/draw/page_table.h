// For every page of one layer of an atlas the finest page there that covers it, as shaders look it up.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/asset/pages.h"

namespace lodestone::vgi {

class PageTable {
public:
    PageTable(const PageTree& tree, uint32_t charts);

    void put(uint32_t number, uint32_t slot);
    void drop(uint32_t number);

    // Calls visit(first chart, entries) for runs of charts whose entries have changed since the last call. An entry is
    // slot << 4 | level of the page in it (LODE_VGI_TABLE); of level 15 where not even the coarsest page is there.
    template <class Visit>
    void for_changed(Visit&& visit) {
        const uint32_t per_chart = tree_.pages();
        for (uint32_t chart = 0; chart < changed_.size();) {
            if (!changed_[chart]) {
                ++chart;
                continue;
            }
            const uint32_t first = chart;
            for (; chart < changed_.size() && changed_[chart]; ++chart) {
                update(chart);
                changed_[chart] = false;
            }
            visit(first, std::span<const uint32_t>(entries_).subspan(size_t{first} * per_chart,
                                                                     size_t{chart - first} * per_chart));
        }
    }

private:
    void update(uint32_t chart);

    PageTree tree_;
    std::vector<uint32_t> slots_;    // per page; ~0: not there
    std::vector<uint32_t> entries_;  // per page
    std::vector<bool> changed_;      // per chart
};

}  // namespace lodestone::vgi
