#include "vgi/draw/page_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "base/random.h"

namespace lodestone::vgi {
namespace {

TEST(PageTable, NamesTheFinestPageThatIsThere) {
    const PageTree tree{128};
    constexpr uint32_t charts = 5;
    PageTable table(tree, charts);
    Random random(4);
    std::map<uint32_t, uint32_t> slots;  // of what is there
    std::vector<uint32_t> uploaded(size_t{charts} * tree.pages(), ~0u);
    for (int round = 0; round < 200; ++round) {
        std::vector<bool> changed(charts, round == 0);
        for (int k = 0; k < 3; ++k) {
            const uint32_t number = random.below(charts * tree.pages());
            changed[number / tree.pages()] = true;
            if (slots.erase(number) > 0) {
                table.drop(number);
            } else {
                slots[number] = random.below(1000);
                table.put(number, slots[number]);
            }
        }
        table.for_changed([&](uint32_t first_chart, std::span<const uint32_t> entries) {
            ASSERT_EQ(entries.size() % tree.pages(), 0u);
            for (uint32_t c = 0; c < entries.size() / tree.pages(); ++c) EXPECT_TRUE(changed[first_chart + c]);
            std::ranges::copy(entries, uploaded.begin() + static_cast<ptrdiff_t>(first_chart * tree.pages()));
        });
        for (uint32_t chart = 0; chart < charts; ++chart) {
            for (uint32_t page = 0; page < tree.pages(); ++page) {
                uint32_t there = page;
                while (there > 0 && !slots.contains(chart * tree.pages() + there)) there = tree.parent(there);
                const uint32_t entry = uploaded[chart * tree.pages() + page];
                uint32_t level = 0, x = 0, y = 0;
                tree.place(there, &level, &x, &y);
                const auto found = slots.find(chart * tree.pages() + there);
                if (found == slots.end()) {
                    ASSERT_EQ(entry & 15, 15u);
                } else {
                    ASSERT_EQ(entry, found->second << 4 | level);
                }
            }
        }
    }
}

}  // namespace
}  // namespace lodestone::vgi
