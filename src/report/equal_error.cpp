#include <algorithm>
#include <cmath>
#include <map>

#include "report/rows.h"

namespace lodestone {

namespace {

constexpr ErrorMetric metrics[] = {
    {"ssim", [](const Row& r) { return r.ssim; }, [](const Row& r) { return 1 - r.ssim; }},
    {"max_pixel_deviation", [](const Row& r) { return r.max_pixel_deviation; },
     [](const Row& r) { return r.max_pixel_deviation; }},
};

double mean_ms(const Row& row) { return row.fps_mean > 0 ? 1000 / row.fps_mean : 0; }

// The rows of one way to draw, finest first.
using Curve = std::vector<const Row*>;

// The cheapest place of a curve that is no worse than `worst`.
EqualError read_curve(const Curve& curve, const ErrorMetric& metric, double worst) {
    EqualError found;
    static_cast<Technique&>(found) = *curve[0];
    const auto take = [&](const Row& row, const char* where) {
        found.pixel_error = row.pixel_error;
        found.ms = mean_ms(row);
        found.where = where;
        return found;
    };
    if (metric.worse(*curve.back()) <= worst) return take(*curve.back(), "at least");
    // From the coarse end: the first pair of neighbours of which the finer is good enough.
    for (size_t i = curve.size() - 1; i-- > 0;) {
        const Row &fine = *curve[i], &coarse = *curve[i + 1];
        const double good = metric.worse(fine), bad = metric.worse(coarse);
        if (good > worst) continue;
        const double t = bad > good ? (worst - good) / (bad - good) : 0;
        found.pixel_error = fine.pixel_error * std::pow(coarse.pixel_error / fine.pixel_error, t);
        found.ms = mean_ms(fine) * std::pow(mean_ms(coarse) / mean_ms(fine), t);
        found.where = "between";
        return found;
    }
    return take(**std::ranges::min_element(curve, {}, [&](const Row* r) { return metric.worse(*r); }), "never");
}

}  // namespace

std::span<const ErrorMetric> error_metrics() { return metrics; }

std::vector<EqualError> at_equal_error(std::span<const Row> rows) {
    std::map<Technique, Curve> curves;
    for (const Row& row : rows) {
        if (row.compared) curves[row].push_back(&row);
    }
    for (auto& [name, curve] : curves) std::ranges::sort(curve, {}, &Row::pixel_error);
    std::vector<EqualError> result;
    for (uint32_t i = 0; i < rows.size(); ++i) {
        if (!rows[i].compared) continue;
        for (const auto& [name, curve] : curves) {
            if (name == static_cast<const Technique&>(rows[i])) continue;
            for (const ErrorMetric& metric : metrics) {
                // `full` deviates from itself by nothing: nobody else could.
                if (rows[i].backend == "full" && metric.worse(rows[i]) <= 0) continue;
                EqualError found = read_curve(curve, metric, metric.worse(rows[i]));
                found.row = i;
                found.metric = metric.name;
                found.value = metric.of(rows[i]);
                found.ratio = mean_ms(rows[i]) > 0 ? found.ms / mean_ms(rows[i]) : 0;
                result.push_back(std::move(found));
            }
        }
    }
    return result;
}

}  // namespace lodestone
