#include "lod/bake/taut_string.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace lodestone {
namespace {

struct Corridor {
    std::vector<double> x, low, high;
};
// Low and high never fall, and are `width` apart.
Corridor rising_corridor(uint64_t seed, size_t count, double width) {
    Corridor c;
    Random random(seed);
    double x = 0, y = 0;
    for (size_t i = 0; i < count; ++i) {
        x += random.uniform(0.1, 1);
        if (random.below(5) == 0) y += random.uniform(0, 3 * width);
        c.x.push_back(x);
        c.low.push_back(y);
        c.high.push_back(y + width);
    }
    return c;
}

TEST(TautString, IsStraightWhereNothingIsInItsWay) {
    const auto y = taut_string(std::vector<double>{0, 1, 3, 4}, std::vector<double>{0, -9, -9, 0},
                               std::vector<double>{9, 9, 9, 8});
    EXPECT_EQ(y, (std::vector<double>{0, 2, 6, 8}));
}

// The shortest line is the only one that bends towards the wall it touches, and nowhere else.
TEST(TautString, BendsOnlyAroundWhatItTouches) {
    size_t bends = 0;
    for (uint64_t seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(seed);
        const Corridor c = rising_corridor(seed, 2 + seed, 0.1 + 0.01 * static_cast<double>(seed));
        const auto y = taut_string(c.x, c.low, c.high);
        ASSERT_EQ(y.size(), c.x.size());
        EXPECT_EQ(y.front(), c.low.front());
        EXPECT_EQ(y.back(), c.high.back());
        for (size_t i = 0; i < y.size(); ++i) {
            ASSERT_GE(y[i], c.low[i] - 1e-9) << i;
            ASSERT_LE(y[i], c.high[i] + 1e-9) << i;
            if (i == 0) continue;
            ASSERT_GT(y[i], y[i - 1]) << i;
            if (i + 1 == y.size()) continue;
            const double before = (y[i] - y[i - 1]) / (c.x[i] - c.x[i - 1]),
                         after = (y[i + 1] - y[i]) / (c.x[i + 1] - c.x[i]);
            if (after < before - 1e-9) {
                ASSERT_NEAR(y[i], c.low[i], 1e-9) << i;
            } else if (after > before + 1e-9) {
                ASSERT_NEAR(y[i], c.high[i], 1e-9) << i;
            }
            bends += std::abs(after - before) > 1e-9;
        }
    }
    EXPECT_GT(bends, 1000u);
}

TEST(TautString, OfOnePointIsThatPoint) {
    const std::vector<double> one = {2};
    EXPECT_EQ(taut_string(one, one, one), one);
}

}  // namespace
}  // namespace lodestone
