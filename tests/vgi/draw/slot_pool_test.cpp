#include "vgi/draw/pages/slot_pool.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "base/random.h"

namespace lodestone::vgi {
namespace {

constexpr uint32_t nothing = SlotPool::nothing;

TEST(SlotPool, GivesAwayWhatWasNotUsedForLongest) {
    SlotPool pool(3);
    pool.begin_frame(0, 0);
    EXPECT_EQ(pool.place(10, nothing, true)->slot, 0u);
    EXPECT_EQ(pool.place(11, 0, false)->slot, 1u);
    EXPECT_EQ(pool.place(12, 0, false)->slot, 2u);
    EXPECT_FALSE(pool.place(13, 0, false)) << "everything is used by this frame";
    pool.begin_frame(1, 1);
    pool.touch(1);
    const auto placed = pool.place(13, 0, false);
    ASSERT_TRUE(placed);
    EXPECT_EQ(placed->evicted, 12u);
    EXPECT_EQ(placed->slot, 2u);
    EXPECT_EQ(pool.page_in(0), 10u);
    EXPECT_EQ(pool.page_in(1), 11u);
    EXPECT_EQ(pool.page_in(2), 13u);
    EXPECT_TRUE(pool.validate());
}

TEST(SlotPool, KeepsPagesThatAFrameOnTheGpuMayRead) {
    SlotPool pool(1);
    pool.begin_frame(5, 0);
    ASSERT_TRUE(pool.place(0, nothing, false));
    pool.begin_frame(6, 5);  // frame 5 is still under way
    EXPECT_FALSE(pool.place(1, nothing, false));
    pool.begin_frame(7, 6);
    EXPECT_TRUE(pool.place(1, nothing, false));
}

TEST(SlotPool, KeepsParentsOfWhatIsThere) {
    SlotPool pool(2);
    pool.begin_frame(0, 0);
    ASSERT_TRUE(pool.place(0, nothing, false));
    ASSERT_TRUE(pool.place(1, 0, false));
    pool.begin_frame(1, 1);
    pool.touch(1);  // the parent is older than its child
    pool.begin_frame(2, 2);
    const auto placed = pool.place(2, nothing, false);
    ASSERT_TRUE(placed);
    EXPECT_EQ(placed->evicted, 1u);
    EXPECT_EQ(pool.page_in(0), 0u);
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

TEST(SlotPool, DoesWhatAPlainOneDoesUnderRandomTraces) {
    for (uint64_t seed = 0; seed < 40; ++seed) {
        Random random(seed);
        const uint32_t pages = 40 + random.below(60), slots = 8 + random.below(24);
        SlotPool pool(slots);
        std::map<uint32_t, uint32_t> slot_of;
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
                if (slot_of.contains(page)) {
                    pool.touch(slot_of[page]);
                    if (!pinned.contains(page)) oracle.touch(page);
                    continue;
                }
                // Trees four wide: the parent of page p is p / 4, of 0 none.
                const uint32_t parent = page == 0 ? nothing : page / 4;
                if (parent != nothing && !slot_of.contains(parent)) continue;
                const bool pin = page < 3;
                const auto placed = pool.place(page, parent == nothing ? nothing : slot_of[parent], pin);
                const auto expected = oracle.place(page, parent, pin);
                ASSERT_EQ(placed.has_value(), expected.first) << seed << " " << frame;
                if (!placed) continue;
                ASSERT_EQ(placed->evicted, expected.second) << seed << " " << frame;
                if (placed->evicted != nothing) slot_of.erase(placed->evicted);
                slot_of[page] = placed->slot;
                if (pin) pinned.insert(page);
            }
            const auto valid = pool.validate();
            ASSERT_TRUE(valid) << valid.error().message;
            for (const uint32_t page : pinned) ASSERT_TRUE(slot_of.contains(page)) << "pinned pages never leave";
            ASSERT_EQ(slot_of.size(), oracle.pages.size());
            for (const auto& [page, slot] : slot_of) {
                ASSERT_TRUE(oracle.pages.contains(page));
                ASSERT_EQ(pool.page_in(slot), page);
            }
        }
    }
}

}  // namespace
}  // namespace lodestone::vgi
