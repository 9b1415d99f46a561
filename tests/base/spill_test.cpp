#include "base/spill.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <thread>
#include <vector>

#include "base/threads.h"

namespace lodestone {
namespace {

uint64_t resident_bytes() {
    std::ifstream statm("/proc/self/statm");
    uint64_t whole = 0, resident = 0;
    statm >> whole >> resident;
    return resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

// Until the watching thread has looked from beginning to end: it may get its turn late where other programs run.
void wait_for_a_look() {
    const uint64_t before = spill_statistics().looks;
    while (spill_statistics().looks < before + 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

// Several times what may be resident, written and read by several threads: nothing is lost, and little is in memory.
TEST(Spill, HoldsMoreThanMayBeResident) {
    // A sanitizer's shadow of these blocks (an eighth of them) stays, and counts as resident; there is room for it.
    constexpr size_t blocks = 80, words = size_t{4} << 20;  // 16 MiB each
    constexpr uint64_t allowed = uint64_t{512} << 20;
    EXPECT_EQ(spill_allocate(words * 4), nullptr);  // not begun
    EXPECT_FALSE(begin_spilling({"/nowhere/at/all", allowed}));
    ASSERT_TRUE(begin_spilling({std::filesystem::temp_directory_path(), allowed}));
    EXPECT_FALSE(begin_spilling({std::filesystem::temp_directory_path(), allowed}));
    EXPECT_EQ(spill_allocate(1000), nullptr);  // too small
    const uint64_t before = resident_bytes();
    std::vector<uint32_t*> held;
    uint64_t most = 0;
    for (size_t b = 0; b < blocks; ++b) {
        held.push_back(static_cast<uint32_t*>(spill_allocate(words * 4)));
        ASSERT_NE(held.back(), nullptr);
        parallel_for(words, words / 8, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) held[b][i] = static_cast<uint32_t>(b * words + i);
        });
        most = std::max(most, resident_bytes());
    }
    for (size_t b = 0; b < blocks; ++b) {
        size_t wrong = 0;
        for (size_t i = 0; i < words; ++i) wrong += held[b][i] != static_cast<uint32_t>(b * words + i);
        EXPECT_EQ(wrong, 0u);
        most = std::max(most, resident_bytes());
        wait_for_a_look();
    }
    EXPECT_LT(most, allowed + before);
    const SpillStatistics holding = spill_statistics();
    EXPECT_EQ(holding.blocks, blocks);
    EXPECT_EQ(holding.bytes, blocks * words * 4);
    EXPECT_GT(holding.dropped, 0u);
    EXPECT_FALSE(holding.full);
    int elsewhere = 0;
    EXPECT_FALSE(spill_release(&elsewhere));
    for (uint32_t* block : held) EXPECT_TRUE(spill_release(block));
    EXPECT_FALSE(spill_release(held[0]));
    EXPECT_EQ(spill_statistics().bytes, 0u);
    // Released blocks wait to be given out again: to who asks for as much or somewhat less, once each.
    void* again = spill_allocate(words * 3);
    EXPECT_TRUE(std::ranges::count(held, again) == 1);
    void* another = spill_allocate(words * 4);
    EXPECT_TRUE(std::ranges::count(held, another) == 1);
    EXPECT_NE(another, again);
    EXPECT_TRUE(spill_release(again));
    EXPECT_TRUE(spill_release(another));
    EXPECT_EQ(spill_statistics().blocks, 0u);
}

}  // namespace
}  // namespace lodestone
