#include "vgi/draw/pages/page_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "base/random.h"

namespace lodestone::vgi {
namespace {

TEST(PageTable, NamesTheFinestPageThatIsThere) {
    const PageTree tree{128};
    Random random(4);
    std::map<uint32_t, uint32_t> slots;  // of what is there
    for (int round = 0; round < 200; ++round) {
        const uint32_t page = random.below(tree.pages());
        if (slots.erase(page) == 0) slots[page] = random.below(1000);
        std::vector<uint32_t> entries = {7};  // of another chart
        append_table_row(
            tree, [&](uint32_t p) { return slots.contains(p) ? slots[p] : ~0u; }, entries);
        ASSERT_EQ(entries.size(), 1 + tree.pages());
        for (uint32_t p = 0; p < tree.pages(); ++p) {
            uint32_t there = p;
            while (there > 0 && !slots.contains(there)) there = tree.parent(there);
            if (slots.contains(there)) {
                ASSERT_EQ(entries[1 + p], slots[there] << 4 | tree.level(there));
            } else {
                ASSERT_EQ(entries[1 + p] & 15, 15u);
            }
        }
    }
}

}  // namespace
}  // namespace lodestone::vgi
