#include "mesh/predicates.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace lodestone {
namespace {

__extension__ typedef __int128 Wide;

// The sign by integers, of coordinates that are multiples of `unit` below 2^60 of them.
int by_integers(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c, double unit) {
    const auto whole = [&](double x) { return static_cast<Wide>(x / unit); };
    const Wide area =
        (whole(a.x) - whole(c.x)) * (whole(b.y) - whole(c.y)) - (whole(a.y) - whole(c.y)) * (whole(b.x) - whole(c.x));
    return area > 0 ? 1 : area < 0 ? -1 : 0;
}

// Points about a line, steps of a last digit apart: there the rounded formula is wrong nearly half of the time.
TEST(Predicates, OrientationIsExactNextToALine) {
    const double unit = std::ldexp(1.0, -53);
    size_t rounded_wrong = 0, on_line = 0;
    for (int x = 0; x < 128; ++x) {
        for (int y = 0; y < 128; ++y) {
            const glm::dvec2 p(0.5 + x * unit, 0.5 + y * unit), q(12, 12), r(24, 24);
            const int expected = by_integers(p, q, r, unit);
            EXPECT_EQ(orientation(p, q, r), expected);
            EXPECT_EQ(orientation(q, r, p), expected);
            EXPECT_EQ(orientation(q, p, r), -expected);
            const double rounded = (p.x - r.x) * (q.y - r.y) - (p.y - r.y) * (q.x - r.x);
            rounded_wrong += (rounded > 0 ? 1 : rounded < 0 ? -1 : 0) != expected;
            on_line += expected == 0;
        }
    }
    EXPECT_GT(rounded_wrong, 1000u);
    EXPECT_EQ(on_line, 128u);
}

TEST(Predicates, OrientationIsExactForRandomPoints) {
    Random random(7);
    const double unit = std::ldexp(1.0, -52);
    for (int i = 0; i < 20000; ++i) {
        const auto point = [&] { return glm::dvec2(random.unit(), random.unit()); };
        const glm::dvec2 a = point(), b = point();
        // Near the line through both, more and more.
        const glm::dvec2 on = a + (b - a) * random.unit();
        const glm::dvec2 c = on + (point() - 0.5) * std::ldexp(1.0, -(i % 56));
        const auto whole = [&](const glm::dvec2& p) {
            return glm::dvec2(std::floor(p.x / unit) * unit, std::floor(p.y / unit) * unit);
        };
        EXPECT_EQ(orientation(whole(a), whole(b), whole(c)), by_integers(whole(a), whole(b), whole(c), unit));
    }
}

}  // namespace
}  // namespace lodestone
