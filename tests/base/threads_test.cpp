#include "base/threads.h"

#include <gtest/gtest.h>

#include <vector>

namespace lodestone {
namespace {

TEST(ParallelFor, VisitsEveryItemOnceForAnyNumberOfThreads) {
    for (const unsigned threads : {1u, 2u, 8u}) {
        set_thread_count(threads);
        std::vector<int> visits(1003, 0);
        parallel_for(visits.size(), 10, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) ++visits[i];
        });
        EXPECT_EQ(visits, std::vector<int>(1003, 1));
    }
    set_thread_count(0);
}

TEST(ParallelFor, NestsOnTheCallingThread) {
    std::vector<int> visits(64, 0);
    parallel_for(8, 1, [&](size_t begin, size_t) {
        parallel_for(8, 1, [&](size_t inner, size_t) { ++visits[begin * 8 + inner]; });
    });
    EXPECT_EQ(visits, std::vector<int>(64, 1));
}

}  // namespace
}  // namespace lodestone
