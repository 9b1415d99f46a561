#include "report/error_search.h"

#include <algorithm>
#include <cmath>

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

}  // namespace lodestone
