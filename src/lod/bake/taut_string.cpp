#include "lod/bake/taut_string.h"

#include <cstddef>

#include "base/check.h"

namespace lodestone {

namespace {

struct Knot {
    double x, y;
};
double slope(const Knot& a, const Knot& b) { return (b.y - a.y) / (b.x - a.x); }

// The part of the corridor that the apex sees is bounded by two chains from it: below by the concave one over `low`,
// above by the convex one under `high`.
class Funnel {
public:
    explicit Funnel(const Knot& start) : knots_{start} {}

    void add(const Knot& low, const Knot& high) {
        add_to(above_, below_, high, 1);
        add_to(below_, above_, low, -1);
    }
    std::vector<Knot> finish(const Knot& end) {
        add(end, end);
        knots_.push_back(end);
        return std::move(knots_);
    }

private:
    struct Chain {
        std::vector<Knot> knots;
        size_t first = 0;
        bool empty() const { return first == knots.size(); }
        const Knot& front() const { return knots[first]; }
        void restart(const Knot& only) {
            knots.assign(1, only);
            first = 0;
        }
    };

    // side: 1 where the chain is the one above.
    void add_to(Chain& chain, Chain& other, const Knot& knot, double side) {
        while (!chain.empty()) {
            const Knot& before = chain.knots.size() - chain.first > 1 ? chain.knots.end()[-2] : knots_.back();
            if (side * (slope(chain.knots.back(), knot) - slope(before, chain.knots.back())) > 0) break;
            chain.knots.pop_back();
        }
        const bool alone = chain.empty();
        chain.knots.push_back(knot);
        if (!alone) return;
        // What the apex sees of the knot may be hidden by the other chain: then the line bends there.
        while (!other.empty() && other.front().x < knot.x &&
               side * (slope(knots_.back(), knot) - slope(knots_.back(), other.front())) < 0) {
            knots_.push_back(other.front());
            ++other.first;
        }
        chain.restart(knot);
    }

    std::vector<Knot> knots_;  // of the line as far as it is known; the last is the apex
    Chain above_, below_;
};

}  // namespace

std::vector<double> taut_string(std::span<const double> x, std::span<const double> low, std::span<const double> high) {
    LODE_CHECK(!x.empty() && x.size() == low.size() && x.size() == high.size(), x.size(), low.size(), high.size());
    std::vector<double> y(x.size(), low[0]);
    if (x.size() == 1) return y;
    Funnel funnel({x[0], low[0]});
    for (size_t i = 1; i + 1 < x.size(); ++i) funnel.add({x[i], low[i]}, {x[i], high[i]});
    const std::vector<Knot> knots = funnel.finish({x.back(), high.back()});
    size_t k = 1;
    for (size_t i = 1; i < x.size(); ++i) {
        while (knots[k].x < x[i]) ++k;
        const Knot &a = knots[k - 1], &b = knots[k];
        y[i] = knots[k].x == x[i] ? b.y : a.y + (b.y - a.y) * ((x[i] - a.x) / (b.x - a.x));
    }
    return y;
}

}  // namespace lodestone
