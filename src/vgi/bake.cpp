#include "vgi/bake.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <mutex>

#include "base/check.h"
#include "base/clock.h"
#include "base/threads.h"
#include "mesh/distance.h"
#include "vgi/chart_error.h"
#include "vgi/quadrangulate.h"
#include "vgi/resample.h"

namespace lodestone::vgi {

namespace {

// Clusters of a wanted area A are cut out of triangles with edges of at most this share of sqrt(A): large triangles,
// as in models of machines, would leave them no choice.
constexpr double edge_share = 0.25;

double longest_edge(const TriMesh& mesh, uint32_t clusters) {
    double area = 0;
    for (size_t t = 0; t < mesh.triangle_count(); ++t)
        area += glm::length(area_vector(glm::dvec3(mesh.position_of(t, 0)), glm::dvec3(mesh.position_of(t, 1)),
                                        glm::dvec3(mesh.position_of(t, 2)))) /
                2;
    return edge_share * std::sqrt(area / std::max(clusters, 1u));
}

}  // namespace

Result<Atlas> make_atlas(const TriMesh& source, const AtlasOptions& options, AtlasReport& report,
                         const Progress& progress) {
    LODE_CHECK(source.triangle_count() > 0 && options.cells >= 2);
    TriMesh with_normals;
    const TriMesh* mesh = &source;
    if (source.normals.empty()) {
        with_normals = source;
        compute_normals(with_normals);
        mesh = &with_normals;
    }
    const PresentAttributes present = attributes_of(source);
    Quads quads;
    {
        const Surface surface = surface_of(*mesh, longest_edge(*mesh, options.clusters.clusters), &report.changes);
        auto clusters = make_clusters(surface, options.clusters, progress);
        if (!clusters) return tl::unexpected(clusters.error());
        report.clusters = clusters->count;
        report.buckets = clusters->buckets;
        report.cut_seconds = clusters->cut_seconds;
        report.bucket_seconds = clusters->bucket_seconds;
        report.merge_seconds = clusters->merge_seconds;
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        progress.at("quads", 0);
        const Stopwatch watch;
        auto cut = quadrangulate(surface, clusters->label, clusters->count);
        if (!cut) return tl::unexpected(cut.error());
        quads = std::move(*cut);
        report.uniform_clusters = quads.uniform_clusters;
        report.quadrangulate_seconds = watch.wall();
    }
    if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    const Stopwatch watch;
    const auto count = static_cast<uint32_t>(quads.quads.size());
    report.charts = count;
    auto patches = trace_patches(quads.surface, quads.surface.twins(), quads.label, count);
    if (!patches) return tl::unexpected(patches.error());
    // Sides begin at the quad's first corner.
    std::vector<std::vector<uint32_t>> members(count);
    for (uint32_t t = 0; t < quads.label.size(); ++t) members[quads.label[t]].push_back(t);
    for (uint32_t q = 0; q < count; ++q) {
        auto& sides = patches->sides[q];
        if (sides.size() != 4) return fail(Fault::invariant, "quad " + std::to_string(q) + " has not four sides");
        const auto begins = [&](const Side& side) {
            const auto& v = patches->arcs[side.arc].vertices;
            return (side.reversed ? v.back() : v.front()) == quads.quads[q].corners[0];
        };
        std::rotate(sides.begin(), std::ranges::find_if(sides, begins), sides.end());
    }
    Resampler resampler(*mesh, quads.surface, *patches, options.cells);
    struct PerChart {
        double area = 0, stretch = 0, tutte = 0;
        uint32_t missing = 0, flipped = 0;
        bool uniform = false;
        std::vector<double> bounds;
        std::vector<SourceSample> samples;
    };
    std::vector<PerChart> per_chart(count);
    std::vector<std::string> faults(count);
    std::mutex clock_mutex;
    double parameterise_seconds = 0, resample_seconds = 0, error_seconds = 0;
    const double whole_area = quads.surface.area();
    // The largest first, so that no thread is left with one at the end.
    std::vector<uint32_t> order(count);
    for (uint32_t q = 0; q < count; ++q) order[q] = q;
    std::ranges::stable_sort(order, std::greater<>(), [&](uint32_t q) { return members[q].size(); });
    parallel_for(count, 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            if (progress.stopped()) return;
            const uint32_t q = order[i];
            const Stopwatch chart_watch;
            auto chart =
                parameterise(quads.surface, members[q], patches->sides[q], patches->arcs, options.parameterise);
            if (!chart) {
                faults[q] = chart.error().message;
                continue;
            }
            const double parameterised = chart_watch.wall();
            const uint32_t missing = resampler.sample(q, *chart);
            uint32_t flipped = 0;
            for (uint32_t t = 0; t < chart->patch.triangles.size(); ++t)
                flipped += !(chart->patch.signed_flat_area(t) > 0);
            const double sampled = chart_watch.wall() - parameterised;
            const auto samples = static_cast<uint32_t>(
                std::ceil(static_cast<double>(options.error_samples) * chart->area / std::max(whole_area, 1e-300)));
            PerChart& c = per_chart[q];
            c = {chart->area, chart->stretch, chart->tutte_stretch, missing, flipped, chart->uniform, {}, {}};
            if (missing == 0) {
                c.bounds = parametric_bounds(resampler.atlas(), q, *chart);
                c.samples = sample_source(q, *chart, samples);
            }
            const double measured = chart_watch.wall() - parameterised - sampled;
            const std::lock_guard lock(clock_mutex);
            parameterise_seconds += parameterised;
            resample_seconds += sampled;
            error_seconds += measured;
            progress.at("charts", static_cast<double>(i) / count);
        }
    });
    if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
    double area = 0, tutte = 0, stretch = 0;
    std::vector<SourceSample> samples;
    std::vector<double> bounds(resampler.atlas().levels(), 0);
    for (uint32_t q = 0; q < count; ++q) {
        if (!faults[q].empty()) return fail(Fault::invariant, "chart " + std::to_string(q) + ": " + faults[q]);
        const PerChart& c = per_chart[q];
        area += c.area;
        tutte += c.area * c.tutte * c.tutte;
        stretch += c.area * c.stretch * c.stretch;
        report.l2_stretch_worst = std::max(report.l2_stretch_worst, c.stretch);
        report.missing_samples += c.missing;
        report.flipped_triangles += c.flipped;
        report.uniform_charts += c.uniform;
        for (size_t level = 0; level < c.bounds.size(); ++level)
            bounds[level] = std::max(bounds[level], c.bounds[level]);
        samples.insert(samples.end(), c.samples.begin(), c.samples.end());
        resampler.atlas().cluster[q] = quads.quads[q].cluster;
    }
    report.l2_stretch_tutte = area > 0 ? std::sqrt(tutte / area) : 1;
    report.l2_stretch_rms = area > 0 ? std::sqrt(stretch / area) : 1;
    const double share = watch.wall() / std::max(1e-9, parameterise_seconds + resample_seconds + error_seconds);
    report.parameterise_seconds = parameterise_seconds * share;
    report.resample_seconds = resample_seconds * share;
    report.error_seconds = error_seconds * share;
    if (report.missing_samples > 0)
        return fail(Fault::invariant, std::to_string(report.missing_samples) + " samples lie in no triangle");
    Atlas atlas = resampler.take();
    atlas.attributes = present;
    double largest = 0;
    for (const double bound : bounds) {
        largest = std::max(largest, bound);
        atlas.errors.push_back(static_cast<float>(largest * sampling_margin));
    }
    const Stopwatch distance_watch;
    progress.at("distance", 0);
    const AtlasDistance finest = measure_finest(atlas, *mesh, samples);
    report.rms_error = finest.rms;
    report.max_error = finest.max;
    report.error_seconds += distance_watch.wall();
    return atlas;
}

}  // namespace lodestone::vgi
