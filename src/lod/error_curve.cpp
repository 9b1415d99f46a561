#include "lod/error_curve.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "lod/cursor.h"
#include "mesh/distance.h"

namespace lodestone {

namespace {

// Sampling finds almost the largest distance, and a level between two measured ones may be slightly worse than both.
constexpr double sampling_margin = 1.05;

// Levels to measure, ascending, full detail left out and the base among them: evenly spread over log(triangles).
std::vector<uint32_t> levels_to_measure(const ProgressiveMesh& pm, uint32_t count) {
    const uint32_t last = pm.levels() - 1;
    std::vector<uint32_t> levels;
    if (last < count) {
        for (uint32_t level = 1; level <= last; ++level) levels.push_back(level);
        return levels;
    }
    const double full = pm.triangles_at(0), base = std::max(1u, pm.triangles_at(last));
    for (uint32_t i = 1; i <= count; ++i) {
        const double triangles = full * std::pow(base / full, static_cast<double>(i) / count);
        const uint32_t level =
            i == count ? last : std::max(1u, pm.level_for_triangles(static_cast<uint64_t>(triangles)));
        if (levels.empty() || level > levels.back()) levels.push_back(level);
    }
    return levels;
}

}  // namespace

Result<std::vector<float>> measure_errors(const ProgressiveMesh& pm, const ErrorCurveOptions& options,
                                          const Progress& progress) {
    LODE_CHECK(options.measured_levels >= 2, options.measured_levels);
    std::vector<float> errors(pm.levels(), 0.0f);
    const std::vector<uint32_t> levels = levels_to_measure(pm, options.measured_levels);
    if (levels.empty()) return errors;
    const TriMesh source = extract_level(pm, 0);
    DistanceOptions distance;
    // More points than a few per triangle would find nothing new on a small mesh.
    distance.samples = std::min<uint64_t>(options.samples, 2000 + 8 * source.triangle_count());
    distance.seed = options.seed;
    double largest = 0;
    uint32_t done = 0;  // levels up to here have their error
    for (size_t i = 0; i < levels.size(); ++i) {
        progress.at("measure errors", static_cast<double>(i) / static_cast<double>(levels.size()));
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        largest = std::max(largest, surface_distance(source, extract_level(pm, levels[i]), distance).max());
        const auto error = static_cast<float>(largest * sampling_margin);
        while (done < levels[i]) errors[++done] = error;
    }
    return errors;
}

}  // namespace lodestone
