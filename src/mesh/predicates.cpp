#include "mesh/predicates.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace lodestone {

namespace {

// high + low, exactly: high is the rounded result, low what rounding took.
struct Pair {
    double high, low;
};
Pair two_sum(double a, double b) {
    const double sum = a + b, b_part = sum - a, a_part = sum - b_part;
    return {sum, (a - a_part) + (b - b_part)};
}
Pair two_product(double a, double b) {
    const double product = a * b;
    return {product, std::fma(a, b, -product)};
}

// A number as a sum of doubles that do not overlap, the smallest first.
class Expansion {
public:
    void add(double value) {
        size_t kept = 0;
        for (size_t i = 0; i < count_; ++i) {
            const Pair s = two_sum(value, terms_[i]);
            if (s.low != 0) terms_[kept++] = s.low;
            value = s.high;
        }
        if (value != 0) terms_[kept++] = value;
        count_ = kept;
    }
    int sign() const {
        const double largest = count_ > 0 ? terms_[count_ - 1] : 0;
        return largest > 0 ? 1 : largest < 0 ? -1 : 0;
    }

private:
    std::array<double, 17> terms_{};
    size_t count_ = 0;
};

}  // namespace

int orientation(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
    const double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x), area = left - right;
    constexpr double half_ulp = std::numeric_limits<double>::epsilon() / 2;
    constexpr double bound = (3 + 16 * half_ulp) * half_ulp;  // ccwerrboundA there
    if (std::abs(area) > bound * (std::abs(left) + std::abs(right))) return area > 0 ? 1 : -1;

    // (ax - cx) (by - cy) - (ay - cy) (bx - cx), each difference of two parts, each product of four times two.
    const Pair ax = two_sum(a.x, -c.x), ay = two_sum(a.y, -c.y), bx = two_sum(b.x, -c.x), by = two_sum(b.y, -c.y);
    Expansion whole;
    const auto add_product = [&](const Pair& p, const Pair& q, double times) {
        for (const double u : {p.low, p.high}) {
            for (const double v : {q.low, q.high}) {
                const Pair product = two_product(times * u, v);
                whole.add(product.low);
                whole.add(product.high);
            }
        }
    };
    add_product(ax, by, 1);
    add_product(ay, bx, -1);
    return whole.sign();
}

}  // namespace lodestone
