#include "frame/error_controller.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <utility>
#include <vector>

#include "base/random.h"

namespace lodestone {
namespace {

// Milliseconds of a frame by pixel error, recorded with `lodestone bench assets/rock.scene.json` (two cores, software
// rasteriser), and one that falls more steeply than any.
using Costs = std::vector<std::pair<double, double>>;
const Costs vgi_rock{{0.0625, 525.3}, {0.25, 216.1}, {0.5, 125.7}, {1, 58.1},
                     {2, 32.3},       {4, 18.9},     {16, 11.5},   {64, 11.5}};
const Costs lod_rock{{0.0625, 147.8}, {0.25, 152}, {0.5, 134.3}, {1, 82.8},
                     {2, 40.5},       {4, 27.3},   {16, 10.2},   {64, 7.2}};
const Costs steep{{0.0625, 2560}, {64, 0.0025 * 64}};

double cost_at(const Costs& costs, double error) {
    auto high = std::ranges::find_if(costs, [&](const auto& c) { return c.first >= error; });
    if (high == costs.begin()) return high->second;
    if (high == costs.end()) return costs.back().second;
    const auto low = high - 1;
    const double t = std::log(error / low->first) / std::log(high->first / low->first);
    return low->second * std::pow(high->second / low->second, t);
}

struct Trace {
    std::vector<double> ms, errors;
};
// The scene weighs `load(frame)` times what was recorded; a frame's cost is told `delay` frames late, with noise.
template <class Load>
Trace run(ErrorController& controller, const Costs& costs, uint32_t frames, uint32_t delay, double noise, Load&& load) {
    Trace result;
    Random random(11);
    std::deque<std::pair<double, double>> under_way;
    for (uint32_t f = 0; f < frames; ++f) {
        result.errors.push_back(controller.error());
        const double slow = random.unit() < 0.03 && noise > 0 ? 3 : 1;  // now and then something else runs
        under_way.emplace_back(
            cost_at(costs, controller.error()) * load(f) * slow * (1 + noise * (2 * random.unit() - 1)),
            controller.error());
        result.ms.push_back(cost_at(costs, controller.error()) * load(f));
        if (under_way.size() > delay) {
            controller.record(under_way.front().first, under_way.front().second);
            under_way.pop_front();
        }
    }
    return result;
}

// How often a series turns round by more than a share of its value.
int turns(const std::vector<double>& values, size_t from, double share) {
    int count = 0, direction = 0;
    double extreme = values[from];
    for (size_t i = from; i < values.size(); ++i) {
        const double change = values[i] / extreme - 1;
        if (direction >= 0 && change < -share) {
            count += direction > 0;
            direction = -1;
        } else if (direction <= 0 && change > share) {
            count += direction < 0;
            direction = 1;
        } else if (change * direction < 0) {
            continue;
        }
        if (change * direction >= 0) extreme = values[i];
    }
    return count;
}

TEST(ErrorController, SettlesWithinSixtyFramesOfAStepWithoutSwinging) {
    struct Case {
        const Costs* costs;
        double target, heavier;
    };
    for (const Case& c : {Case{&vgi_rock, 50, 1.5}, Case{&vgi_rock, 50, 0.6}, Case{&lod_rock, 40, 1.6},
                          Case{&lod_rock, 30, 0.5}, Case{&steep, 16, 3.0}, Case{&steep, 16, 0.3}}) {
        for (const uint32_t delay : {0u, 1u, 2u}) {
            SCOPED_TRACE(testing::Message() << c.target << " ms, load x " << c.heavier << ", delay " << delay);
            ErrorController controller(c.target, 1);
            const Trace r =
                run(controller, *c.costs, 300, delay, 0, [&](uint32_t f) { return f < 120 ? 1.0 : c.heavier; });
            for (const size_t f : {119u, 180u, 240u, 299u}) EXPECT_NEAR(r.ms[f] / c.target, 1, 0.05) << f;
            EXPECT_EQ(turns(r.errors, 120, 0.02), 0);
            EXPECT_DOUBLE_EQ(r.errors[240], r.errors[299]) << "what holds its time does not change";
        }
    }
}

TEST(ErrorController, LeavesNoiseAndSingleSlowFramesAlone) {
    ErrorController controller(50, 1);
    const Trace r = run(controller, vgi_rock, 400, 1, 0.1, [](uint32_t) { return 1.0; });
    const auto [low, high] = std::minmax_element(r.errors.begin() + 100, r.errors.end());
    EXPECT_LT(*high / *low, 1.35);
    for (size_t f = 100; f < r.ms.size(); ++f) EXPECT_NEAR(r.ms[f] / 50, 1, 0.15);
}

TEST(ErrorController, StaysInItsRangeAndComesBackFromItsEndsAtOnce) {
    ErrorController controller(1, 1);  // cannot be held
    run(controller, vgi_rock, 500, 1, 0, [](uint32_t) { return 1.0; });
    EXPECT_EQ(controller.error(), 64);
    controller.aim(50);
    const Trace r = run(controller, vgi_rock, 60, 1, 0, [](uint32_t) { return 1.0; });
    EXPECT_NEAR(r.ms.back() / 50, 1, 0.1);
    controller.aim(1e6);
    run(controller, vgi_rock, 500, 1, 0, [](uint32_t) { return 1.0; });
    EXPECT_EQ(controller.error(), 1.0 / 16);
    EXPECT_EQ(ErrorController(10, 1000, {0.5, 8}).error(), 8);
}

}  // namespace
}  // namespace lodestone
