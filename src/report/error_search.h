// The largest setting that is good enough, found by trying.
#pragma once

#include <functional>
#include <optional>

#include "base/result.h"

namespace lodestone {

struct ErrorSearch {
    double start = 1;       // tried first, > 0
    double range = 64;      // from start / range to start * range
    double nearness = 1.1;  // found within this factor of what is not good any more, > 1
};
// good: whether a setting is, which smaller ones then are, too; measured, so it may fail. Nothing where not even the
// smallest is good.
Result<std::optional<double>> largest_good(const ErrorSearch& search, const std::function<Result<bool>(double)>& good);

}  // namespace lodestone
