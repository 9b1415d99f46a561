#include "vgi/draw/page_table.h"

namespace lodestone::vgi {

namespace {
constexpr uint32_t absent = ~0u;
constexpr uint32_t nothing = 15;  // a level that no page has
}  // namespace

PageTable::PageTable(const PageTree& tree, uint32_t charts)
    : tree_(tree),
      slots_(size_t{charts} * tree.pages(), absent),
      entries_(slots_.size(), nothing),
      changed_(charts, true) {}

void PageTable::put(uint32_t number, uint32_t slot) {
    slots_[number] = slot;
    changed_[number / tree_.pages()] = true;
}

void PageTable::drop(uint32_t number) { put(number, absent); }

void PageTable::update(uint32_t chart) {
    const uint32_t first = chart * tree_.pages();
    // Parents come before their children.
    for (uint32_t page = 0; page < tree_.pages(); ++page) {
        uint32_t level = 0, x = 0, y = 0;
        tree_.place(page, &level, &x, &y);
        const uint32_t slot = slots_[first + page];
        entries_[first + page] = slot != absent ? slot << 4 | level
                                 : page > 0     ? entries_[first + tree_.parent(page)]
                                                : nothing;
    }
}

}  // namespace lodestone::vgi
