// Settings found by trying: the largest that is good enough, and the error that holds a frame's time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "base/result.h"

namespace lodestone {

// Where and how finely a setting is looked for.
struct ErrorSearch {
    double start = 1;       // tried first, > 0
    double range = 64;      // from start / range to start * range
    double nearness = 1.1;  // found within this factor of what is not good any more, > 1
};
// Looks for the largest setting that is good.
// good: whether a setting is, which smaller ones then are, too; measured, so it may fail. Nothing where not even the
// smallest is good.
Result<std::optional<double>> largest_good(const ErrorSearch& search, const std::function<Result<bool>(double)>& good);

// The time that is to be held, and where its pixel error is looked for.
struct FrameTimeSearch {
    double target_ms = 0;                // what a frame may take, > 0
    double least = 1.0 / 16, most = 64;  // pixel errors to look among, 0 < least <= 1 <= most
    double nearness = 0.03;              // of the target: near enough to stop, and to hold it
    uint32_t most_tries = 12;            // > 0
};
// What was found.
struct FrameTimeFound {
    size_t which;  // try, in the order they were made
    bool holds;    // the target, within nearness
};
// Looks for the smallest pixel error that holds a frame time.
// median_ms_at: what a frame takes at a pixel error, ms, > 0; measured, so it may fail, and two tries may differ by
// chance. Of the errors tried that hold the target the smallest; where none does, the fastest of all.
Result<FrameTimeFound> error_that_holds(const FrameTimeSearch& search,
                                        const std::function<Result<double>(double)>& median_ms_at);

// The highest level that holds the time; the lowest, where none does.
struct LevelFound {
    uint32_t level;  // that was found
    bool holds;      // the target
};
// Looks for the highest of a few levels, each slower than the one below it, that holds a frame time.
// median_ms_at: what a frame takes at a level, lowest .. highest, ms, > 0; measured, so it may fail. A level is tried
// once at most.
Result<LevelFound> level_that_holds(uint32_t lowest, uint32_t highest, double target_ms,
                                    const std::function<Result<double>(uint32_t)>& median_ms_at);

}  // namespace lodestone
