#include "vgi/draw/page_pool.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "base/random.h"

namespace lodestone::vgi {
namespace {

constexpr uint32_t nothing = PagePool::nothing;

TEST(PagePool, GivesAwayWhatWasNotUsedForLongest) {
    PagePool pool(6, 3);
    pool.begin_frame(0, 0);
    EXPECT_EQ(pool.place(0, nothing, true)->slot, 0u);
    EXPECT_EQ(pool.place(1, 0, false)->slot, 1u);
    EXPECT_EQ(pool.place(2, 0, false)->slot, 2u);
    EXPECT_FALSE(pool.place(3, 0, false)) << "everything is used by this frame";
    pool.begin_frame(1, 1);
    pool.touch(1);
    const auto placed = pool.place(3, 0, false);
    ASSERT_TRUE(placed);
    EXPECT_EQ(placed->evicted, 2u);
    EXPECT_EQ(placed->slot, 2u);
    EXPECT_TRUE(pool.holds(0) && pool.holds(1) && pool.holds(3));
    EXPECT_TRUE(pool.validate());
}

TEST(PagePool, KeepsPagesThatAFrameOnTheGpuMayRead) {
    PagePool pool(4, 1);
    pool.begin_frame(5, 0);
    ASSERT_TRUE(pool.place(0, nothing, false));
    pool.begin_frame(6, 5);  // frame 5 is still under way
    EXPECT_FALSE(pool.place(1, nothing, false));
    pool.begin_frame(7, 6);
    EXPECT_TRUE(pool.place(1, nothing, false));
}

TEST(PagePool, KeepsParentsOfWhatIsThere) {
    PagePool pool(4, 2);
    pool.begin_frame(0, 0);
    ASSERT_TRUE(pool.place(0, nothing, false));
    ASSERT_TRUE(pool.place(1, 0, false));
    pool.begin_frame(1, 1);
    pool.touch(1);  // the parent is older than its child
    pool.begin_frame(2, 2);
    const auto placed = pool.place(2, nothing, false);
    ASSERT_TRUE(placed);
    EXPECT_EQ(placed->evicted, 1u);
    EXPECT_TRUE(pool.holds(0));
}

// The same rules, written as plainly as can be.
struct Oracle {
    struct Page {
        uint64_t used, order;
        uint32_t parent;
        bool pinned;
    };
    std::map<uint32_t, Page> pages;
    uint32_t slots;
    uint64_t frame = 0, completed = 0, order = 0;

    void touch(uint32_t page) {
        pages[page].used = frame;
        pages[page].order = ++order;
    }
    // Whether there was room, and who had to go.
    std::pair<bool, uint32_t> place(uint32_t page, uint32_t parent, bool pinned) {
        uint32_t gone = nothing;
        if (pages.size() == slots) {
            uint64_t oldest = ~uint64_t{0};
            for (const auto& [number, p] : pages) {
                bool has_child = false;
                for (const auto& [other, q] : pages) has_child = has_child || q.parent == number;
                if (p.pinned || has_child || p.used >= frame || p.used >= completed || number == parent) continue;
                if (p.order < oldest) {
                    oldest = p.order;
                    gone = number;
                }
            }
            if (gone == nothing) return {false, nothing};
            pages.erase(gone);
        }
        pages[page] = {frame, ++order, parent, pinned};
        return {true, gone};
    }
};

TEST(PagePool, DoesWhatAPlainOneDoesUnderRandomTraces) {
    for (uint64_t seed = 0; seed < 40; ++seed) {
        Random random(seed);
        const uint32_t pages = 40 + random.below(60), slots = 8 + random.below(24);
        PagePool pool(pages, slots);
        Oracle oracle{{}, slots};
        uint64_t completed = 0;
        std::set<uint32_t> pinned;
        for (uint64_t frame = 0; frame < 200; ++frame) {
            completed = std::min(frame, std::max(completed, frame - std::min<uint64_t>(frame, random.below(4))));
            pool.begin_frame(frame, completed);
            oracle.frame = frame;
            oracle.completed = completed;
            for (uint32_t i = random.below(12); i > 0; --i) {
                const uint32_t page = random.below(pages);
                if (pool.holds(page)) {
                    pool.touch(page);
                    if (!pinned.contains(page)) oracle.touch(page);
                    continue;
                }
                // Trees four wide: the parent of page p is p / 4, of 0 none.
                const uint32_t parent = page == 0 ? nothing : page / 4;
                if (parent != nothing && !pool.holds(parent)) continue;
                const bool pin = page < 3;
                const auto placed = pool.place(page, parent, pin);
                const auto expected = oracle.place(page, parent, pin);
                ASSERT_EQ(placed.has_value(), expected.first) << seed << " " << frame;
                if (!placed) continue;
                ASSERT_EQ(placed->evicted, expected.second) << seed << " " << frame;
                if (pin) pinned.insert(page);
            }
            const auto valid = pool.validate();
            ASSERT_TRUE(valid) << valid.error().message;
            for (const uint32_t page : pinned) ASSERT_TRUE(pool.holds(page)) << "pinned pages never leave";
            for (uint32_t page = 0; page < pages; ++page) ASSERT_EQ(pool.holds(page), oracle.pages.contains(page));
        }
    }
}

}  // namespace
}  // namespace lodestone::vgi
