// Voids are filled by push-pull: averages go up a pyramid as far as there are any, and come down where there was
// nothing; then what was filled is smoothed.
//
//   Gortler, Grzeszczuk, Szeliski, Cohen, "The lumigraph", SIGGRAPH 1996, section 3.4, for the pyramid.
#include <algorithm>
#include <cmath>
#include <optional>

#include "mesh/io/heights.h"

namespace lodestone {

namespace {

constexpr int smoothing_rounds = 64;
// A height of this many samples, most of all, may stand for no data where it lies so many times farther from samples
// beside it than these from each other. Tiles of the Shuttle Radar Topography Mission whose voids were written as sea:
// 33 and 80 times; real sea and lakes: less than once.
constexpr size_t many_voids = 16;
constexpr double steep = 8;

struct Level {
    uint32_t width, height;
    std::vector<float> values;  // not finite where there is none
    float at(uint32_t x, uint32_t y) const { return values[size_t{y} * width + x]; }
};

Level halved(const Level& fine) {
    Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
    for (uint32_t y = 0; y < coarse.height; ++y) {
        for (uint32_t x = 0; x < coarse.width; ++x) {
            double sum = 0;
            int count = 0;
            for (uint32_t v = 2 * y; v < std::min(2 * y + 2, fine.height); ++v) {
                for (uint32_t u = 2 * x; u < std::min(2 * x + 2, fine.width); ++u) {
                    if (!std::isfinite(fine.at(u, v))) continue;
                    sum += static_cast<double>(fine.at(u, v));
                    ++count;
                }
            }
            coarse.values.push_back(count > 0 ? static_cast<float>(sum / count) : NAN);
        }
    }
    return coarse;
}

// Between the samples of the coarser level, whose middles are at odd quarters.
float between(const Level& coarse, uint32_t x, uint32_t y) {
    const auto side = [](uint32_t at, uint32_t size) {
        const uint32_t own = at / 2, other = at % 2 == 0 ? std::max(own, 1u) - 1 : own + 1;
        return std::pair(own, std::min(other, size - 1));
    };
    const auto [x0, x1] = side(x, coarse.width);
    const auto [y0, y1] = side(y, coarse.height);
    return 0.5625f * coarse.at(x0, y0) + 0.1875f * (coarse.at(x1, y0) + coarse.at(x0, y1)) +
           0.0625f * coarse.at(x1, y1);
}

}  // namespace

std::optional<VoidGuess> guess_voids(const HeightMap& map) {
    std::vector<float> sorted;
    for (const float sample : map.samples) {
        if (std::isfinite(sample)) sorted.push_back(sample);
    }
    std::ranges::sort(sorted);
    VoidGuess guess;
    for (size_t first = 0, last = 0; first < sorted.size(); first = last) {
        while (last < sorted.size() && sorted[last] == sorted[first]) ++last;
        if (last - first > guess.samples) guess = {sorted[first], last - first, 0};
    }
    if (guess.samples < many_voids) return std::nullopt;
    double around = 0, elsewhere = 0;
    size_t pairs_around = 0, pairs_elsewhere = 0;
    const auto add = [&](float a, float b) {
        if (!std::isfinite(a) || !std::isfinite(b) || (a == guess.height && b == guess.height)) return;
        const bool is_around = a == guess.height || b == guess.height;
        (is_around ? around : elsewhere) += std::abs(static_cast<double>(a) - static_cast<double>(b));
        ++(is_around ? pairs_around : pairs_elsewhere);
    };
    for (size_t i = 0; i < map.samples.size(); ++i) {
        if (i % map.width + 1 < map.width) add(map.samples[i], map.samples[i + 1]);
        if (i + map.width < map.samples.size()) add(map.samples[i], map.samples[i + map.width]);
    }
    if (pairs_around == 0 || !(elsewhere > 0)) return std::nullopt;
    guess.times_farther =
        around / static_cast<double>(pairs_around) / (elsewhere / static_cast<double>(pairs_elsewhere));
    return guess.times_farther >= steep ? std::optional(guess) : std::nullopt;
}

size_t fill_voids(HeightMap& map) {
    std::vector<size_t> voids;
    for (size_t i = 0; i < map.samples.size(); ++i) {
        if (!std::isfinite(map.samples[i])) voids.push_back(i);
    }
    if (voids.empty() || voids.size() == map.samples.size()) return 0;
    std::vector<Level> levels{{map.width, map.height, map.samples}};
    while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(halved(levels.back()));
    for (size_t k = levels.size() - 1; k-- > 0;) {
        Level& fine = levels[k];
        for (uint32_t y = 0; y < fine.height; ++y) {
            for (uint32_t x = 0; x < fine.width; ++x) {
                float& value = fine.values[size_t{y} * fine.width + x];
                if (!std::isfinite(value)) value = between(levels[k + 1], x, y);
            }
        }
    }
    map.samples = std::move(levels[0].values);
    std::vector<float> next(voids.size());
    for (int round = 0; round < smoothing_rounds; ++round) {
        for (size_t i = 0; i < voids.size(); ++i) {
            const auto x = static_cast<uint32_t>(voids[i] % map.width), y = static_cast<uint32_t>(voids[i] / map.width);
            const auto at = [&](uint32_t u, uint32_t v) { return map.samples[size_t{v} * map.width + u]; };
            next[i] = 0.25f * (at(x > 0 ? x - 1 : x, y) + at(std::min(x + 1, map.width - 1), y) +
                               at(x, y > 0 ? y - 1 : y) + at(x, std::min(y + 1, map.height - 1)));
        }
        for (size_t i = 0; i < voids.size(); ++i) map.samples[voids[i]] = next[i];
    }
    return voids.size();
}

}  // namespace lodestone
