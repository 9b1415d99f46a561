#include "report/error_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace lodestone {
namespace {

// What largest_good finds where everything up to `limit` is good, and how often it tried.
std::pair<std::optional<double>, int> found(double limit, const ErrorSearch& search = {}) {
    int tried = 0;
    const auto best = largest_good(search, [&](double at) -> Result<bool> {
        ++tried;
        return at <= limit;
    });
    EXPECT_TRUE(best);
    return {*best, tried};
}

TEST(ErrorSearch, FindsTheLargestThatIsGood) {
    for (const double limit : {0.02, 0.3, 0.999, 1.0, 1.4, 7.0, 60.0}) {
        const auto [best, tried] = found(limit);
        ASSERT_TRUE(best) << limit;
        EXPECT_LE(*best, limit);
        EXPECT_GE(*best, limit / 1.1);
        EXPECT_LE(tried, 12);
    }
}

TEST(ErrorSearch, StaysWithinItsRange) {
    EXPECT_FALSE(found(0.001).first);
    EXPECT_EQ(found(1e9).first, 64.0);
    EXPECT_EQ(found(1e9, {3, 1, 1.1}).first, 3.0);
    EXPECT_FALSE(found(1, {3, 1, 1.1}).first);
}

TEST(ErrorSearch, PassesOnWhatFails) {
    const auto failed = largest_good({}, [](double) -> Result<bool> { return fail(Fault::machine, "no device"); });
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().message, "no device");
}

// The error that was found where a frame takes ms(error), and whether it holds 10 ms.
std::pair<double, bool> held(const std::function<double(double)>& ms) {
    std::vector<double> errors;
    const auto best = error_that_holds({.target_ms = 10}, [&](double error) -> Result<double> {
        errors.push_back(error);
        return ms(error);
    });
    EXPECT_TRUE(best);
    EXPECT_LE(errors.size(), 12u);
    return {errors[best->which], best->holds};
}

TEST(ErrorSearch, FindsTheErrorThatHoldsAFrameTime) {
    for (const double at_one : {3.0, 9.0, 10.0, 14.0, 40.0}) {
        const auto curve = [&](double error) { return at_one * std::pow(error, -0.7); };
        const auto [error, holds] = held(curve);
        EXPECT_TRUE(holds) << at_one;
        EXPECT_NEAR(curve(error), 10, 0.31) << at_one;
    }
}

TEST(ErrorSearch, FindsTheHighestLevelThatHoldsAFrameTime) {
    for (uint32_t slow_from = 1; slow_from <= 9; ++slow_from) {
        std::vector<uint32_t> tried;
        const auto found = level_that_holds(1, 8, 10, [&](uint32_t level) -> Result<double> {
            tried.push_back(level);
            return level < slow_from ? 9 : 11;
        });
        ASSERT_TRUE(found);
        EXPECT_EQ(found->holds, slow_from > 1);
        EXPECT_EQ(found->level, std::max(slow_from - 1, 1u));
        EXPECT_NE(std::ranges::find(tried, found->level), tried.end()) << "it was measured";
        EXPECT_LE(tried.size(), 4u);
        std::ranges::sort(tried);
        EXPECT_EQ(std::ranges::adjacent_find(tried), tried.end()) << "once at most";
    }
    EXPECT_FALSE(level_that_holds(1, 8, 10, [](uint32_t) -> Result<double> { return fail(Fault::machine, "lost"); }));
}

TEST(ErrorSearch, TakesTheFasterSideOfAStep) {
    const auto [error, holds] = held([](double at) { return at < 3.3 ? 20 : 6; });
    EXPECT_TRUE(holds);
    EXPECT_GE(error, 3.3);
    EXPECT_LT(error, 4);
}

TEST(ErrorSearch, EndsWhereItsRangeEnds) {
    EXPECT_EQ(held([](double) { return 0.1; }), std::pair(1.0 / 16, true));
    EXPECT_EQ(held([](double error) { return 100 - error; }), std::pair(64.0, false));
    // Nothing changes but by chance, and the coarsest happens to be slow.
    EXPECT_EQ(held([](double error) { return error == 1 ? 20 : 21; }), std::pair(1.0, false));
}

}  // namespace
}  // namespace lodestone
