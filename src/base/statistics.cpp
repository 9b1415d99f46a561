#include "base/statistics.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "base/check.h"

namespace lodestone {

double percentile(std::span<const double> samples, double fraction) {
    LODE_CHECK(fraction >= 0 && fraction <= 1, fraction);
    if (samples.empty()) return 0;
    std::vector<double> sorted(samples.begin(), samples.end());
    std::sort(sorted.begin(), sorted.end());
    const double rank = fraction * static_cast<double>(sorted.size() - 1);
    const auto low = static_cast<size_t>(rank);
    const size_t high = std::min(low + 1, sorted.size() - 1);
    return sorted[low] + (sorted[high] - sorted[low]) * (rank - static_cast<double>(low));
}

double mean(std::span<const double> samples) {
    if (samples.empty()) return 0;
    return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
}

}  // namespace lodestone
