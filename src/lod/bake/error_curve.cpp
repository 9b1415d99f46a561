#include "lod/bake/error_curve.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "base/random.h"
#include "lod/asset/cursor.h"
#include "mesh/distance/distance.h"

namespace lodestone {

namespace {

// Small meshes are measured at more levels: as many as this many sample points in all allow.
constexpr uint64_t points_in_all = 4'000'000;
constexpr uint32_t most_levels = 400;

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
    DistanceOptions distance;
    // More points than a few per triangle would find nothing new on a small mesh.
    distance.samples = std::min<uint64_t>(options.samples, 2000 + 8 * uint64_t{pm.full_triangles()});
    distance.vertices = 2 * options.samples;
    distance.seed = options.seed;
    const auto affordable = static_cast<uint32_t>(std::min<uint64_t>(points_in_all / distance.samples, most_levels));
    const std::vector<uint32_t> levels = levels_to_measure(pm, std::max(options.measured_levels, affordable));
    if (levels.empty()) return errors;
    const MeasuredSurface source(mesh_of(PmCursor(pm)), distance);
    PmCursor cursor(pm);
    double largest = 0;
    uint32_t done = 0;  // levels up to here have their error
    for (size_t i = 0; i < levels.size(); ++i) {
        progress.at("measure errors", static_cast<double>(i) / static_cast<double>(levels.size()));
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        cursor.goto_level(levels[i]);
        distance.seed = mix64(options.seed + i);
        const MeasuredSurface level(mesh_of(cursor), distance);
        largest = level.farthest_from(source, source.farthest_from(level, largest));
        const auto error = static_cast<float>(largest * sampling_margin);
        while (done < levels[i]) errors[++done] = error;
    }
    return errors;
}

}  // namespace lodestone
