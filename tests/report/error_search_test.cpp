#include "report/error_search.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace lodestone
