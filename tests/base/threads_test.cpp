#include "base/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace lodestone {
namespace {

class ParallelFor : public testing::TestWithParam<unsigned> {
protected:
    void SetUp() override { set_thread_count(GetParam()); }
    void TearDown() override { set_thread_count(0); }
};

// What a loop over `count` items throws where `throws` holds of an item; "" where nothing.
template <class Throws>
std::string thrown_by(size_t count, const Throws& throws) {
    try {
        parallel_for(count, 1, [&](size_t begin, size_t) {
            if (throws(begin)) throw std::runtime_error(std::to_string(begin));
        });
    } catch (const std::runtime_error& e) { return e.what(); }
    return "";
}

TEST_P(ParallelFor, VisitsEveryItemOnce) {
    std::vector<int> visits(1003, 0);
    parallel_for(visits.size(), 10, [&](size_t begin, size_t end) {
        EXPECT_EQ(begin % 10, 0u);
        EXPECT_EQ(end, std::min<size_t>(begin + 10, visits.size()));
        for (size_t i = begin; i < end; ++i) ++visits[i];
    });
    EXPECT_EQ(visits, std::vector<int>(1003, 1));
    parallel_for(0, 10, [&](size_t, size_t) { FAIL() << "no item"; });
    size_t once = 0;
    parallel_for(3, ~size_t{0}, [&](size_t, size_t end) { once += end; });
    EXPECT_EQ(once, 3u);
}

TEST_P(ParallelFor, NestsOnTheCallingThread) {
    std::vector<int> visits(64, 0);
    parallel_for(8, 1, [&](size_t begin, size_t) {
        const std::thread::id outer = std::this_thread::get_id();
        parallel_for(8, 1, [&](size_t inner, size_t) {
            EXPECT_EQ(std::this_thread::get_id(), outer);
            ++visits[begin * 8 + inner];
        });
    });
    EXPECT_EQ(visits, std::vector<int>(64, 1));
}

TEST_P(ParallelFor, HandsTheFirstExceptionToItsCaller) {
    for (int repeat = 0; repeat < 200; ++repeat) {
        EXPECT_EQ(thrown_by(100, [](size_t i) { return i % 7 == 3; }), "3");
        EXPECT_EQ(thrown_by(100, [](size_t i) { return i == 99; }), "99");
        EXPECT_EQ(thrown_by(100, [](size_t) { return false; }), "");
    }
}

TEST_P(ParallelFor, HandsOverBadAllocAsSuch) {
    EXPECT_THROW(parallel_for(64, 1, [](size_t, size_t) { throw std::bad_alloc(); }), std::bad_alloc);
}

// No thread is still inside the body when the exception arrives.
TEST_P(ParallelFor, ThrowsWhenAllChunksHaveEnded) {
    for (int repeat = 0; repeat < 50; ++repeat) {
        std::atomic<int> inside{0};
        EXPECT_THROW(parallel_for(64, 1,
                                  [&](size_t begin, size_t) {
                                      ++inside;
                                      std::this_thread::sleep_for(std::chrono::microseconds(20));
                                      --inside;
                                      if (begin == 5) throw std::runtime_error("five");
                                  }),
                     std::runtime_error);
        EXPECT_EQ(inside, 0);
    }
}

// What is in the only chunk of a loop has all threads.
TEST_P(ParallelFor, LeavesThreadsToLoopsInOneChunk) {
    if (GetParam() == 1) return;  // there is but one
    // Each of the two waits for the other: one after the other they would wait in vain.
    std::atomic<int> here = 0, in_vain = 0;
    parallel_for(1, 1, [&](size_t, size_t) {
        parallel_for(2, 1, [&](size_t, size_t) {
            ++here;
            const auto start = std::chrono::steady_clock::now();
            while (here < 2 && std::chrono::steady_clock::now() - start < std::chrono::seconds(20))
                std::this_thread::yield();
            in_vain += here < 2 ? 1 : 0;
        });
    });
    EXPECT_EQ(here, 2);
    EXPECT_EQ(in_vain, 0);
}

TEST_P(ParallelFor, HandsOnWhatANestedLoopThrows) {
    const auto nested_throw = [](size_t i) {
        if (i % 3 != 2) return false;
        return thrown_by(10, [](size_t j) { return j > 3; }) == "4";
    };
    EXPECT_EQ(thrown_by(30, nested_throw), "2");
    EXPECT_THROW(
        parallel_for(8, 1, [](size_t, size_t) { parallel_for(8, 1, [](size_t, size_t) { throw std::bad_alloc(); }); }),
        std::bad_alloc);
    // Loops are what they were afterwards.
    std::atomic<size_t> sum{0};
    parallel_for(100, 3, [&](size_t begin, size_t end) { sum += end - begin; });
    EXPECT_EQ(sum, 100u);
}

TEST_P(ParallelFor, IsCalledOften) {
    std::vector<uint32_t> counts(16, 0);
    for (uint32_t call = 0; call < 3000; ++call)
        parallel_for(counts.size(), 4, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) ++counts[i];
        });
    EXPECT_EQ(counts, std::vector<uint32_t>(16, 3000));
}

TEST_P(ParallelFor, IsCalledByManyThreadsAtOnce) {
    std::vector<size_t> sums(4, 0);
    std::vector<std::thread> callers;
    for (size_t& sum : sums)
        callers.emplace_back([&sum] {
            for (int call = 0; call < 200; ++call) {
                std::vector<size_t> parts(32, 0);
                parallel_for(parts.size(), 1, [&](size_t begin, size_t) { parts[begin] = begin; });
                for (const size_t part : parts) sum += part;
            }
        });
    for (std::thread& caller : callers) caller.join();
    EXPECT_EQ(sums, std::vector<size_t>(4, 200 * 31 * 16));
}

INSTANTIATE_TEST_SUITE_P(OfSeveralThreads, ParallelFor, testing::Values(1u, 2u, 3u, 8u));

TEST(ThreadCount, BoundsTheThreadsOfALoop) {
    for (const unsigned threads : {8u, 1u, 3u}) {
        set_thread_count(threads);
        std::atomic<unsigned> inside{0}, most{0};
        parallel_for(200, 1, [&](size_t, size_t) {
            const unsigned now = ++inside;
            unsigned before = most;
            while (before < now && !most.compare_exchange_weak(before, now)) continue;
            std::this_thread::sleep_for(std::chrono::microseconds(50));
            --inside;
        });
        EXPECT_LE(most, threads);
    }
    set_thread_count(0);
    EXPECT_GE(thread_count(), 1u);
}

}  // namespace
}  // namespace lodestone
