#include "lod/bake/error_curve.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "lod/bake/level_distance.h"
#include "lod/bake/taut_string.h"

namespace lodestone {

std::vector<float> stated_errors(const std::vector<double>& measured, const std::vector<uint32_t>& triangles,
                                 double resolution) {
    LODE_CHECK(!measured.empty() && measured.size() == triangles.size(), measured.size(), triangles.size());
    constexpr double least_part = 1e-3;  // of the resolution: what levels begin with that lose nothing
    const size_t levels = measured.size();
    std::vector<float> errors(levels, 0.0f);
    if (levels == 1) return errors;
    const double step = std::max(resolution, double{std::numeric_limits<float>::min()});
    std::vector<double> x, low, high;
    for (size_t level = 1; level < levels; ++level) {
        const double lost = std::log(static_cast<double>(triangles[0]) / std::max(1u, triangles[level]));
        x.push_back(lost + 1e-9 * static_cast<double>(level));  // a level may lose no triangle
        low.push_back(std::log(measured[level] > 0 ? measured[level] * stated_least : step * least_part));
        // Where few triangles are gone there is nothing to make even.
        const double most = std::min(stated_most, stated_least + 0.01 + 10 * lost);
        high.push_back(std::log(std::max(measured[level], step) * most));
    }
    const std::vector<double> stated = taut_string(x, low, high);
    for (size_t level = 1; level < levels; ++level) {
        const float next = std::nextafter(errors[level - 1], std::numeric_limits<float>::max());
        errors[level] = std::max(next, static_cast<float>(std::exp(stated[level - 1])));
    }
    return errors;
}

Result<std::vector<float>> measure_errors(const ProgressiveMesh& pm, const ErrorCurveOptions& options,
                                          const Progress& progress) {
    constexpr uint32_t levels_a_report = 1024;
    std::vector<double> measured(1, 0);
    std::vector<uint32_t> triangles(1, pm.full_triangles());
    if (pm.levels() == 1) return std::vector<float>(1, 0.0f);
    LevelDistance distance(pm, {options.samples, options.seed});
    for (uint32_t level = 1; level < pm.levels(); ++level) {
        if (level % levels_a_report == 1) {
            progress.at("measure errors", static_cast<double>(level) / pm.levels());
            if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        }
        measured.push_back(distance.ecol());
        triangles.push_back(pm.triangles_at(level));
    }
    return stated_errors(measured, triangles, distance.resolution());
}

}  // namespace lodestone
