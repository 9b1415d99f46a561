// For every page of a chart the finest page there that covers it, as shaders look it up.
#pragma once

#include <cstdint>
#include <vector>

#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// Appends the entries of one chart's pages: slot << 4 | level of the page in it (LODE_VGI_TABLE); of level 15 where not
// even the coarsest page is there. slot_of(page): the slot of a page of the chart, ~0 where it is not there.
template <class SlotOf>
void append_table_row(const PageTree& tree, SlotOf&& slot_of, std::vector<uint32_t>& entries) {
    constexpr uint32_t absent = ~0u, no_page = 15;
    const size_t first = entries.size();
    // Parents come before their children.
    for (uint32_t page = 0; page < tree.pages(); ++page) {
        const uint32_t slot = slot_of(page);
        entries.push_back(slot != absent ? slot << 4 | tree.level(page)
                          : page > 0     ? entries[first + tree.parent(page)]
                                         : no_page);
    }
}

}  // namespace lodestone::vgi
