#include "frame/error_controller.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/check.h"
#include "base/statistics.h"

namespace lodestone {

namespace {
constexpr double steepness = 1.4;      // of costs, as a power of 1 / error: more than was seen of any backend
constexpr double share = 0.5;          // of the way, per frame
constexpr double near_enough = 0.025;  // misses below, as shares of the target, are left alone
}  // namespace

ErrorController::ErrorController(double target_ms, double error, const Range& range)
    : target_ms_(target_ms), error_(std::clamp(error, range.least, range.most)), range_(range) {
    LODE_CHECK(target_ms > 0 && range.least > 0 && range.least <= range.most, target_ms, range.least, range.most);
}

void ErrorController::aim(double target_ms) {
    LODE_CHECK(target_ms > 0, target_ms);
    target_ms_ = target_ms;
}

void ErrorController::record(double ms, double error) {
    LODE_CHECK(ms > 0 && error > 0, ms, error);
    recent_[frames_ % recent_.size()] = std::log(ms) + steepness * std::log(error);
    ++frames_;
    const double usual = median(std::span<const double>(recent_.data(), std::min<size_t>(frames_, recent_.size())));
    // By how much the next frame would miss.
    const double miss = usual - steepness * std::log(error_) - std::log(target_ms_);
    if (std::abs(miss) < near_enough) return;
    error_ = std::clamp(error_ * std::exp(share * miss / steepness), range_.least, range_.most);
}

}  // namespace lodestone
