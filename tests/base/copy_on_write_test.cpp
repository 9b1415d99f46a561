#include "base/structures/copy_on_write.h"

#include <gtest/gtest.h>

#include <vector>

namespace lodestone {
namespace {

TEST(CopyOnWrite, ASnapshotStaysAsItWasAndNothingIsCopiedWithoutOne) {
    CopyOnWrite<std::vector<int>> value({1, 2, 3});
    const int* const first = value->data();
    value.write()[0] = 5;
    EXPECT_EQ(value->data(), first) << "written in place";
    auto snapshot = value.snapshot();
    value.write()[1] = 7;
    EXPECT_EQ(*snapshot, (std::vector<int>{5, 2, 3}));
    EXPECT_EQ(*value, (std::vector<int>{5, 7, 3}));
    const int* const second = value->data();
    EXPECT_NE(second, first);
    snapshot.reset();
    value.write()[2] = 9;
    EXPECT_EQ(value->data(), second);
}

}  // namespace
}  // namespace lodestone
