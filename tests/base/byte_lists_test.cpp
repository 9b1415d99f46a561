#include "base/structures/byte_lists.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/random.h"

namespace lodestone {
namespace {

TEST(ByteLists, AreWhatWasAdded) {
    Random random(3);
    std::vector<std::vector<std::byte>> added;
    ByteLists lists, halves[2];
    for (size_t i = 0; i < 1000; ++i) {
        std::vector<std::byte>& list = added.emplace_back(random.below(20));
        for (std::byte& b : list) b = static_cast<std::byte>(random.below(256));
        lists.add(list);
        halves[i / 500].add(list);
    }
    ASSERT_EQ(lists.size(), added.size());
    for (size_t i = 0; i < added.size(); ++i) EXPECT_TRUE(std::ranges::equal(lists[i], added[i])) << i;
    halves[0].add(halves[1]);
    EXPECT_EQ(halves[0], lists);
    halves[0].add(std::vector<std::byte>{});
    EXPECT_NE(halves[0], lists);
    EXPECT_TRUE(halves[0][1000].empty());
    EXPECT_TRUE(ByteLists().empty());
}

}  // namespace
}  // namespace lodestone
