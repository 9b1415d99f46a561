#include "report/error_search.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/check.h"

namespace lodestone {

Result<std::optional<double>> largest_good(const ErrorSearch& search, const std::function<Result<bool>(double)>& good) {
    LODE_CHECK(search.start > 0 && search.range >= 1 && search.nearness > 1, search.start, search.range);
    const double smallest = search.start / search.range, largest = search.start * search.range;
    std::optional<double> best, bad;
    double at = search.start;
    for (;;) {
        const auto answer = good(at);
        if (!answer) return tl::unexpected(answer.error());
        (*answer ? best : bad) = at;
        if (best && bad && *bad <= *best * search.nearness) return best;
        if ((best && *best >= largest) || (bad && *bad <= smallest)) return best;
        // Between what is known, or on in steps of an octave until something is known to both sides.
        at = best && bad ? std::sqrt(*best * *bad) : std::clamp(*answer ? at * 2 : at / 2, smallest, largest);
    }
}

Result<FrameTimeFound> error_that_holds(const FrameTimeSearch& search,
                                        const std::function<Result<double>(double)>& median_ms_at) {
    LODE_CHECK(search.target_ms > 0 && search.least > 0 && search.least <= 1 && search.most >= 1, search.target_ms,
               search.least, search.most);
    struct Try {
        double error, ratio;  // of the time to the target
    };
    std::vector<Try> tried;
    std::optional<Try> slow, fast;  // the errors next to the one looked for, from both sides
    double error = 1;
    while (tried.size() < search.most_tries) {
        const auto ms = median_ms_at(error);
        if (!ms) return tl::unexpected(ms.error());
        const Try now = tried.emplace_back(Try{error, *ms / search.target_ms});
        if (std::abs(now.ratio - 1) < search.nearness) return FrameTimeFound{tried.size() - 1, true};
        (now.ratio > 1 ? slow : fast) = now;
        if (slow && fast) {
            // Where a power law through both would hit, but not at the very ends.
            const double share = std::log(slow->ratio) / std::log(slow->ratio / fast->ratio);
            const double width = std::log(fast->error / slow->error);
            if (width < 0.02) break;
            error = slow->error * std::exp(width * std::clamp(share, 0.1, 0.9));
        } else {
            if (error == (slow ? search.most : search.least)) break;
            error = std::clamp(error * now.ratio * now.ratio * (slow ? 1.2 : 1 / 1.2), search.least, search.most);
        }
    }
    const auto rank = [](const Try& t) { return t.ratio <= 1 ? std::pair(1, -t.error) : std::pair(0, -t.ratio); };
    const auto best = std::ranges::max_element(tried, {}, rank);
    return FrameTimeFound{static_cast<size_t>(best - tried.begin()), best->ratio <= 1};
}

Result<LevelFound> level_that_holds(uint32_t lowest, uint32_t highest, double target_ms,
                                    const std::function<Result<double>(uint32_t)>& median_ms_at) {
    LODE_CHECK(lowest <= highest && target_ms > 0, lowest, highest, target_ms);
    // Those below `low` hold it, those from `high` on do not. The highest is tried first: often nothing is given up.
    uint32_t low = lowest, high = highest + 1;
    for (uint32_t level = highest; low < high; level = low + (high - low) / 2) {
        const auto ms = median_ms_at(level);
        if (!ms) return tl::unexpected(ms.error());
        if (*ms <= target_ms) {
            low = level + 1;
        } else {
            high = level;
        }
    }
    return low > lowest ? LevelFound{low - 1, true} : LevelFound{lowest, false};
}

}  // namespace lodestone
