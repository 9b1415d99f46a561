#include "base/structures/quad_heap.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/random.h"

namespace lodestone {
namespace {

TEST(QuadHeap, GivesTheLeastOfWhatIsLeft) {
    Random random(3);
    QuadHeap<int> heap;
    std::vector<int> left;  // sorted
    for (int i = 0; i < 20000; ++i) {
        // Grows, shrinks, and is empty now and then; many are equal.
        const bool grows = (i / 1000) % 2 == 0 ? random.unit() < 0.7 : random.unit() < 0.2;
        if (grows) {
            const int item = static_cast<int>(random.unit() * 500) - 250;
            heap.push(item);
            left.insert(std::ranges::lower_bound(left, item), item);
        } else if (!left.empty()) {
            ASSERT_EQ(heap.pop(), left.front());
            left.erase(left.begin());
        }
        ASSERT_EQ(heap.empty(), left.empty());
    }
    for (int item : {3, 1, 2}) heap.push(item);
    ASSERT_FALSE(heap.empty());
    heap.clear();
    EXPECT_TRUE(heap.empty());
}

}  // namespace
}  // namespace lodestone
