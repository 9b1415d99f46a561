#include "vgi/unwrap/unwrap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <string>

#include "base/check.h"
#include "base/clock.h"
#include "base/threads.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/charts/clusters.h"
#include "vgi/bake/charts/refinement.h"
#include "vgi/unwrap/flat_chart.h"
#include "vgi/unwrap/lattice.h"
#include "vgi/unwrap/packing.h"
#include "vgi/unwrap/unwrapped_mesh.h"

namespace lodestone::vgi {

namespace {

// Charts for a mesh, where none are asked for: so many triangles to each, within bounds.
constexpr uint32_t fewest_charts = 24, most_charts = 640, triangles_per_chart = 2000;

uint32_t charts_for(const TriMesh& mesh, const UnwrapOptions& options) {
    if (options.charts > 0) return options.charts;
    return std::clamp(static_cast<uint32_t>(mesh.triangle_count() / triangles_per_chart), fewest_charts, most_charts);
}

// Charts of a mesh, cut finer where they are stretched too much.
class Charting {
public:
    Charting(const TriMesh& mesh, const UnwrapOptions& options, UnwrapReport& report, const Progress& progress)
        : mesh_(mesh),
          options_(options),
          report_(report),
          progress_(progress),
          joined_(joined_surface(mesh)),
          twins_(joined_.surface.twins()),
          clusters_wanted_(charts_for(mesh, options)) {}

    Result<std::vector<FlatChart>> run() {
        if (!joined_.surface.triangles.empty()) {
            if (auto done = make_rounds(); !done) return tl::unexpected(done.error());
            if (auto done = break_up(); !done) return tl::unexpected(done.error());
        }
        for (const uint32_t t : joined_.lone) {
            auto chart = lay_flat(surface_of_triangle(t), std::array<uint32_t, 1>{0});
            if (!chart) return tl::unexpected(chart.error());
            chart->patch.triangles[0].source = t;
            for (uint32_t k = 0; k < 3; ++k)
                chart->patch.origin[chart->patch.triangles[0].vertices[k]] = mesh_.vertex_of(t, static_cast<int>(k));
            charts_.push_back(std::move(*chart));
        }
        report_.charts = static_cast<uint32_t>(charts_.size());
        measure_seams();
        return std::move(charts_);
    }

private:
    Surface surface_of_triangle(uint32_t t) const {
        Surface surface;
        for (int k = 0; k < 3; ++k) surface.positions.emplace_back(mesh_.position_of(t, k));
        surface.triangles.push_back({{0, 1, 2}, 0});
        return surface;
    }

    Result<void> make_rounds() {
        ClusterOptions cluster;
        cluster.clusters = clusters_wanted_;
        if (cluster.weights.feature > 0) cluster.features = FeatureLines(mesh_);
        Refinement rounds(clusters_wanted_, options_.worst_stretch, mesh_.triangle_count(), options_.most_rounds);
        for (;;) {
            ++report_.rounds;
            const Stopwatch watch;
            auto clusters = make_clusters(joined_.surface, cluster, progress_);
            if (!clusters) return tl::unexpected(clusters.error());
            smooth_borders(twins_, clusters->label);
            label_ = std::move(clusters->label);
            report_.cluster_seconds += watch.wall();
            rounds.begin(clusters->count);
            if (auto done = lay_out(clusters->count); !done) return done;
            const RoundQuality quality = look_at(rounds);
            const bool good = std::ranges::find(quality.bad, true) == quality.bad.end();
            if (!good && !fault_.empty() && report_.rounds >= options_.most_rounds)
                return fail(Fault::invariant, fault_);
            if (good || (fault_.empty() && (rounds.is_last() || !rounds.improves(cost_, quality)))) return {};
            refine(rounds, quality, cluster);
        }
    }

    Result<void> lay_out(uint32_t count) {
        const Stopwatch watch;
        progress_.at("charts", 0);
        const std::vector<std::vector<uint32_t>> members = members_of(label_, count);
        std::vector<FlatChart> before = std::move(charts_);
        charts_ = std::vector<FlatChart>(count);
        faults_.assign(count, {});
        // Clusters that are as they were have their charts.
        std::vector<uint32_t> by_first(joined_.surface.triangles.size(), none);
        for (uint32_t c = 0; c < members_.size(); ++c) by_first[members_[c].front()] = c;
        parallel_for(count, 1, [&](size_t begin, size_t end) {
            for (size_t c = begin; c < end && !progress_.stopped(); ++c) {
                const uint32_t was = by_first[members[c].front()];
                if (was != none && members_[was] == members[c] && before[was].area > 0) {
                    charts_[c] = std::move(before[was]);
                    continue;
                }
                auto chart = lay_flat(joined_.surface, members[c]);
                if (chart)
                    charts_[c] = std::move(*chart);
                else
                    faults_[c] = chart.error().message;
            }
        });
        members_ = members;
        report_.lay_out_seconds += watch.wall();
        if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        return {};
    }

    RoundQuality look_at(const Refinement& rounds) {
        RoundQuality quality{std::vector<bool>(charts_.size(), false), std::vector<double>(charts_.size(), 0)};
        fault_.clear();
        cost_ = 0;
        for (size_t c = 0; c < charts_.size(); ++c) {
            if (!faults_[c].empty()) {
                fault_ = faults_[c];
                quality.bad[c] = true;
                continue;
            }
            const double stretch = charts_[c].best_stretch();
            if (stretch <= rounds.bound() || members_[c].size() <= few_triangles) continue;
            quality.bad[c] = true;
            quality.stretch[c] = stretch;
            cost_ += RoundQuality::cost(charts_[c].area, stretch, rounds.bound());
        }
        return quality;
    }

    void refine(const Refinement& rounds, const RoundQuality& quality, ClusterOptions& cluster) const {
        const Surface& surface = joined_.surface;
        cluster.density.resize(surface.triangles.size(), 1.0f);
        const std::vector<double> times = rounds.times_denser(
            quality, wanted_where(surface, cluster.density, label_, quality.bad.size(), clusters_wanted_));
        std::vector<bool> forgotten(mesh_.triangle_count(), false);
        for (uint32_t t = 0; t < label_.size(); ++t) {
            if (!quality.bad[label_[t]]) continue;
            cluster.density[t] *= static_cast<float>(times[label_[t]]);
            forgotten[surface.triangles[t].source] = true;
        }
        cluster.features.forget(forgotten);
        cluster.kept = kept_clusters(surface, label_, quality.bad);
    }

    // Small charts that stay stretched, as spikes do, become charts of one triangle each.
    Result<void> break_up() {
        const auto count = static_cast<uint32_t>(charts_.size());
        for (uint32_t c = 0; c < count; ++c) {
            if (charts_[c].best_stretch() <= options_.worst_stretch || members_[c].size() > most_broken_up) continue;
            for (size_t i = 0; i < members_[c].size(); ++i) {
                const uint32_t t = members_[c][i];
                auto chart = lay_flat(joined_.surface, std::span(&t, 1));
                if (!chart) return tl::unexpected(chart.error());
                label_[t] = i == 0 ? c : static_cast<uint32_t>(charts_.size());
                if (i > 0) charts_.emplace_back();
                charts_[label_[t]] = std::move(*chart);
            }
        }
        return {};
    }

    void measure_seams() {
        for (uint32_t h = 0; h < twins_.size(); ++h) {
            if (twins_[h] == none || twins_[h] < h || label_[h / 3] == label_[twins_[h] / 3]) continue;
            ++report_.seam_edges;
            report_.seam_length += joined_.surface.length(h);
        }
    }

    // Charts of so few triangles are not cut finer by other clusters.
    static constexpr size_t few_triangles = 8, most_broken_up = 64;

    const TriMesh& mesh_;
    const UnwrapOptions& options_;
    UnwrapReport& report_;
    const Progress& progress_;
    const JoinedSurface joined_;
    const std::vector<uint32_t> twins_;
    const uint32_t clusters_wanted_;
    std::vector<uint32_t> label_;                 // per triangle of the surface
    std::vector<std::vector<uint32_t>> members_;  // per chart
    std::vector<FlatChart> charts_;
    std::vector<std::string> faults_;  // per chart, empty where it could be laid out
    std::string fault_;                // the last of them
    double cost_ = 0;                  // of stretched charts
};

// A chart takes no more of a square than if it were stretched so much.
constexpr double most_counted = 3;

// Shapes for packing: areas by which the stretch of all together is least.
std::vector<WantedRectangle> shapes_of(const std::vector<FlatChart>& charts) {
    double whole = 0;
    for (const FlatChart& chart : charts) whole += chart.area;
    std::vector<WantedRectangle> shapes;
    for (const FlatChart& chart : charts) {
        // None is so small that it has no texels at all.
        const double area = std::max(chart.area, 1e-12 * whole) * std::min(chart.best_stretch(), most_counted) /
                            chart.filled,
                     aspect = chart.best_aspect();
        const double height = area > 0 ? std::sqrt(area / aspect) : 1;
        shapes.push_back({height * aspect, height});
    }
    return shapes;
}

void report_stretch(const std::vector<FlatChart>& charts, const std::vector<PackedRectangle>& places,
                    UnwrapReport& report) {
    double sum = 0, covered = 0, area = 0;
    for (size_t c = 0; c < charts.size(); ++c) {
        const FlatChart& chart = charts[c];
        const double width = places[c].turned ? places[c].height : places[c].width,
                     height = places[c].turned ? places[c].width : places[c].height;
        sum += (chart.along_x / (width * width) + chart.along_y / (height * height)) / 2;
        covered += chart.filled * width * height;
        area += chart.area;
        report.l2_stretch_worst = std::max(report.l2_stretch_worst, chart.stretch(width, height));
    }
    report.l2_stretch_rms = area > 0 ? std::sqrt(sum * covered) / area : 1;
}

// Where vertices of all charts lie. Charts that rounding turns over in places are laid out with equal weights.
Result<std::vector<std::vector<LatticePoint>>> lattice_of(std::vector<FlatChart>& charts,
                                                          const std::vector<PackedRectangle>& places) {
    std::vector<std::vector<LatticePoint>> points(charts.size());
    std::vector<uint32_t> left(charts.size(), 0);
    parallel_for(charts.size(), 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) {
            points[c] = onto_lattice(charts[c], places[c], left[c]);
            if (left[c] == 0) continue;
            lay_evenly(charts[c]);
            points[c] = onto_lattice(charts[c], places[c], left[c]);
        }
    });
    for (size_t c = 0; c < charts.size(); ++c) {
        if (left[c] == 0) continue;
        return fail(Fault::invariant, "chart " + std::to_string(c) + " has " + std::to_string(left[c]) +
                                          " triangles that are too small for texture coordinates of 24 bits; use "
                                          "fewer charts, or more textures");
    }
    return points;
}

void check(const Unwrapped& made, const UnwrapOptions& options, UnwrapReport& report) {
    std::vector<LatticeTriangle> triangles;
    triangles.reserve(made.mesh.triangle_count());
    double area = 0;
    for (size_t t = 0; t < made.mesh.triangle_count(); ++t) {
        LatticeTriangle triangle{made.square[t], {}};
        for (size_t k = 0; k < 3; ++k) {
            // From what is written, and exactly.
            const glm::dvec2 uv(made.mesh.uvs[made.mesh.triangles[t][k]]);
            triangle.corners[k] = LatticePoint(glm::dvec2(uv.x, 1 - uv.y) * static_cast<double>(lattice_side));
        }
        area += static_cast<double>(twice_area(triangle.corners[0], triangle.corners[1], triangle.corners[2])) / 2;
        triangles.push_back(triangle);
    }
    const double square = static_cast<double>(lattice_side) * static_cast<double>(lattice_side);
    report.coverage = area / (square * options.textures);
    const LatticeFaults faults = faults_of(triangles, options.textures);
    report.flipped = faults.flipped;
    report.overlapping = faults.overlapping;
}

}  // namespace

Result<Unwrapped> unwrap(const TriMesh& mesh, const UnwrapOptions& options, UnwrapReport& report,
                         const Progress& progress) {
    LODE_CHECK(mesh.triangle_count() > 0 && options.textures > 0 && options.most_rounds > 0);
    constexpr size_t most_materials = 65536;  // wedges refer to them by 16 bits
    if (options.textures > 1 && mesh.material_table.size() * options.textures > most_materials)
        return fail(Fault::usage, std::to_string(mesh.material_table.size()) + " materials for each of " +
                                      std::to_string(options.textures) + " textures are more than 65536; use fewer");
    auto charts = Charting(mesh, options, report, progress).run();
    if (!charts) return tl::unexpected(charts.error());
    const Stopwatch pack_watch;
    progress.at("pack", 0);
    const auto places = pack(shapes_of(*charts), options.textures, options.gutter);
    if (!places)
        return fail(Fault::usage, "the gutters of " + std::to_string(charts->size()) +
                                      " charts leave no room for them; use a larger --resolution, more --textures or a "
                                      "smaller --gutter");
    auto points = lattice_of(*charts, *places);
    if (!points) return tl::unexpected(points.error());
    report_stretch(*charts, *places, report);
    Unwrapped made = unwrapped_mesh(mesh, *charts, *places, *points, options.textures);
    *charts = {};
    report.pack_seconds = pack_watch.wall();
    const Stopwatch check_watch;
    progress.at("check", 0);
    report.source_triangles = mesh.triangle_count();
    report.source_vertices = mesh.vertex_count();
    report.triangles = made.mesh.triangle_count();
    report.vertices = made.mesh.vertex_count();
    check(made, options, report);
    report.check_seconds = check_watch.wall();
    if (report.flipped > 0 || report.overlapping > 0)
        return fail(Fault::invariant, std::to_string(report.flipped) + " triangles are turned over and " +
                                          std::to_string(report.overlapping) + " pairs overlap");
    return made;
}

}  // namespace lodestone::vgi
