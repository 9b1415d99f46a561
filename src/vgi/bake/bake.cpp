#include "vgi/bake/bake.h"

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>

#include "base/check.h"
#include "base/clock.h"
#include "base/threads.h"
#include "mesh/distance/distance.h"
#include "vgi/bake/charts/quadrangulate.h"
#include "vgi/bake/charts/refinement.h"
#include "vgi/bake/checkpoints.h"
#include "vgi/bake/images/chart_error.h"
#include "vgi/bake/images/chart_sizes.h"
#include "vgi/bake/images/resample.h"
#include "vgi/bake/images/sample_errors.h"

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

// Where samples are closer together than this share of what is usual, a chart may be stretched more by as much:
// clusters as small as the topology asks for are what they are, and have samples to spare.
constexpr double close_samples = 0.25;
constexpr size_t charts_at_once = 64;
constexpr uint32_t fewest_samples = 32;  // of a chart's distance to the source

// Per cluster: how many are wanted where it is, of `clusters` in all.
std::vector<double> wanted_of(const Surface& surface, const std::vector<float>& density,
                              const std::vector<uint32_t>& label, size_t count, double clusters) {
    std::vector<double> wanted(count, 0);
    const double cluster = surface.area() / clusters;
    for (size_t t = 0; t < label.size(); ++t)
        wanted[label[t]] += wanted_of_triangle(surface.area(t), density[t], cluster) / std::max(cluster, 1e-300);
    return wanted;
}

// One round: clusters, quads and charts of a surface with a density of clusters.
class RefinementRound {
public:
    RefinementRound(const TriMesh& mesh, std::span<const glm::vec3> normals, const FeatureLines& features,
                    const AtlasOptions& options, AtlasReport& report, Refinement& rounds, const Progress& progress,
                    const CheckpointFolder* work)
        : mesh_(mesh),
          normals_(normals),
          features_(features),
          options_(options),
          report_(report),
          rounds_(rounds),
          progress_(progress),
          work_(work) {}

    // What is wrong with its clusters goes to quality(), `fault` says it of the last that could not be made.
    Result<void> run(Surface surface, const std::vector<float>& density, std::vector<uint32_t> kept) {
        ClusterOptions cluster_options = options_.clusters;
        cluster_options.density = density;
        cluster_options.kept = std::move(kept);
        cluster_options.features = features_;
        auto clusters = load_or_make<Clusters>(
            work_, stage("clusters"), read_clusters, [&] { return make_clusters(surface, cluster_options, progress_); },
            [](const Clusters& made, ChunkWriter& writer) { return write_checkpoint(made, writer); });
        if (!clusters) return tl::unexpected(clusters.error());
        clusters_ = std::move(*clusters);
        quality_ = {std::vector<bool>(clusters_.count, false), std::vector<double>(clusters_.count, 0)};
        dirty_.assign(clusters_.count, false);
        find_doubtful(surface, cluster_options.kept);
        for (const ReadyQuad& quad : clusters_.ready) dirty_[quad.cluster] = true;
        report_.clusters = clusters_.count;
        report_.template_charts = static_cast<uint32_t>(clusters_.ready.size());
        report_.buckets = clusters_.buckets;
        report_.cut_seconds += clusters_.cut_seconds;
        report_.bucket_seconds += clusters_.bucket_seconds;
        report_.merge_seconds += clusters_.merge_seconds;
        if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        rounds_.begin(report_.clusters);
        last_ = rounds_.is_last();
        auto straight = load_or_make<StraightQuads>(
            work_, stage("quads"), read_quads, [&] { return make_quads(std::move(surface)); },
            [](const StraightQuads& made, ChunkWriter& writer) { return write_checkpoint(made, writer); });
        if (!straight) return tl::unexpected(straight.error());
        quads_ = std::move(straight->quads);
        report_.not_recentred = straight->not_recentred;
        report_.uniform_clusters = quads_.uniform_clusters;
        for (const uint32_t c : quads_.failed) {
            quality_.bad[c] = true;
            fault_ = "cluster " + std::to_string(c) + " " + quads_.fault;
        }
        if (!quads_.failed.empty()) return {};
        return make_charts();
    }

    const std::vector<uint32_t>& label() const { return clusters_.label; }
    const RoundQuality& quality() const { return quality_; }
    const std::string& fault() const { return fault_; }
    // Whether stretched charts are taken as they are.
    bool is_last() const { return last_; }

    Result<Atlas> take() {
        report_.l2_stretch_tutte = report_.l2_stretch_rms = report_.l2_stretch_worst = 0;
        report_.missing_samples = report_.flipped_triangles = report_.uniform_charts = 0;
        report_.folded_cells = report_.still_folded_cells = 0;
        double area = 0, tutte = 0, stretch = 0;
        std::vector<SourceSample> samples;
        std::vector<double> level_errors(resampler_->atlas().levels(), 0);
        std::vector<std::vector<double>> page_errors;
        for (uint32_t q = 0; q < charts_.size(); ++q) {
            const ChartResult& made = charts_[q];
            const ChartResult::Figures& c = made.figures;
            area += c.area;
            tutte += c.area * c.tutte_stretch * c.tutte_stretch;
            stretch += c.area * c.stretch * c.stretch;
            report_.l2_stretch_worst = std::max(report_.l2_stretch_worst, c.stretch);
            report_.missing_samples += c.sampled.missing;
            report_.folded_cells += c.sampled.folded;
            report_.still_folded_cells += c.sampled.still_folded;
            report_.flipped_triangles += c.flipped;
            report_.uniform_charts += c.uniform;
            for (uint32_t level = 0; level < level_errors.size() && !made.errors.levels.empty(); ++level)
                level_errors[level] =
                    std::max(level_errors[level], made.errors.levels[resampler_->atlas().own_level(q, level)]);
            page_errors.push_back(made.errors.pages);
            samples.insert(samples.end(), made.samples.begin(), made.samples.end());
            resampler_->atlas().cluster[q] = quads_.quads[q].cluster;
        }
        report_.charts = static_cast<uint32_t>(charts_.size());
        report_.l2_stretch_tutte = area > 0 ? std::sqrt(tutte / area) : 1;
        report_.l2_stretch_rms = area > 0 ? std::sqrt(stretch / area) : 1;
        if (report_.missing_samples > 0)
            return fail(Fault::invariant, std::to_string(report_.missing_samples) + " samples lie in no triangle");
        Atlas atlas = resampler_->take();
        quads_ = {};
        patches_ = {};
        charts_ = {};
        double largest = 0;
        for (const double error : level_errors) {
            largest = std::max(largest, error);
            atlas.errors.push_back(static_cast<float>(largest * sampling_margin));
        }
        const Stopwatch watch;
        progress_.at("errors", 0);
        saturate(atlas);
        if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        bound_pages(atlas, page_errors);
        if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        progress_.at("distance", 0);
        const AtlasDistance finest = measure_finest(atlas, mesh_, samples);
        report_.rms_error = finest.rms;
        report_.max_error = finest.max;
        report_.error_seconds += watch.wall();
        return atlas;
    }

private:
    // Its name in the work folder.
    std::string stage(const std::string& what) const {
        return "atlas-" + std::to_string(options_.clusters.clusters) + "-" + std::to_string(report_.rounds) + "-" +
               what;
    }

    // Those that are not as they were (kept: ClusterOptions::kept), and what is around them: borders are moved
    // together.
    void find_doubtful(const Surface& surface, std::span<const uint32_t> kept) {
        if (kept.empty()) return;
        const std::vector<uint32_t>& label = clusters_.label;
        std::vector<uint32_t> now(kept.size(), none);  // per cluster before
        for (size_t t = 0; t < kept.size(); ++t) {
            if (kept[t] == none || (now[kept[t]] != none && now[kept[t]] != label[t])) {
                dirty_[label[t]] = true;
            } else {
                now[kept[t]] = label[t];
            }
        }
        dirty_ = with_neighbours(surface, label, std::move(dirty_));
    }

    // Quads of the clusters, made straight; or what has failed.
    Result<StraightQuads> make_quads(Surface surface) {
        progress_.at("quads", 0);
        const Stopwatch watch;
        auto cut = quadrangulate(std::move(surface), clusters_);
        if (!cut) return tl::unexpected(cut.error());
        StraightQuads made{std::move(*cut), 0};
        report_.quadrangulate_seconds += watch.wall();
        if (!made.quads.failed.empty()) return made;
        progress_.at("straighten", 0);
        const Stopwatch straighten_watch;
        std::vector<Pivot> passes;
        for (uint32_t pass = 0; pass < options_.recentre_passes; ++pass) {
            if (pass % 2 == 0) passes.push_back(Pivot::outer_middles);
            passes.push_back(pass % 2 == 0 ? Pivot::corners : Pivot::centres);
        }
        for (const Pivot pivot : passes) {
            auto left = recentre(made.quads, pivot, features_);
            if (!left) return tl::unexpected(left.error());
            made.not_recentred += *left;
        }
        report_.straighten_seconds += straighten_watch.wall();
        return made;
    }

    ChartSizes sizes_of(const std::vector<std::vector<uint32_t>>& members) const {
        constexpr double charts_per_cluster = 2 * usual_charts_per_cluster;  // of clusters wanted
        const double row = options_.cells + 1,
                     most = std::max(options_.most_texels_per_triangle * static_cast<double>(mesh_.triangle_count()),
                                     charts_per_cluster * options_.clusters.clusters * row * row);
        return chart_sizes(quads_.surface, members, patches_, options_.clusters.clusters, options_.cells, most);
    }

    // From the error of sampling, as a few charts show it.
    void choose_lattice(const std::vector<std::vector<uint32_t>>& members) {
        constexpr uint32_t charts_looked_at = 12, samples_of_each = 1000;
        const auto count = static_cast<uint32_t>(members.size()), looked_at = std::min(count, charts_looked_at);
        std::vector<double> area(looked_at, 0), squared(looked_at, 0);
        parallel_for(looked_at, 1, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                const auto q = static_cast<uint32_t>(i * count / looked_at);
                const auto chart =
                    parameterise(quads_.surface, members[q], patches_.sides[q], patches_.arcs, options_.parameterise);
                if (!chart || resampler_->sample(q, *chart).missing > 0) continue;
                area[i] = chart->area;
                squared[i] =
                    chart->area * mean_squared_distance(resampler_->atlas(), sample_source(q, *chart, samples_of_each));
            }
        });
        const double whole = std::accumulate(area.begin(), area.end(), 0.0);
        if (!(whole > 0)) return;
        const double rms = std::sqrt(std::accumulate(squared.begin(), squared.end(), 0.0) / whole);
        // What is rounded to steps is off by a step over the square root of 12 in any direction.
        resampler_->set_step(options_.rounding_share * rms * std::sqrt(12.0));
    }

    // A chart of a height field whose samples stay folded is sheared too much for the lattice. The more often weights
    // were changed the less it is stretched, but the more it is sheared: so they are changed less often.
    void shear_less(uint32_t q, std::span<const uint32_t> members, Chart& chart, Sampled& sampled) {
        ParameteriseOptions options = options_.parameterise;
        bool is_sampled = true;
        for (uint32_t solves = chart.solves / 2; solves > 0 && sampled.still_folded > 0; solves /= 2) {
            options.most_solves = solves;
            auto other = parameterise(quads_.surface, members, patches_.sides[q], patches_.arcs, options);
            if (!other || other->stretch > options_.worst_stretch) break;
            const Sampled less = resampler_->sample(q, *other);
            is_sampled = less.missing == 0 && less.still_folded < sampled.still_folded;
            if (!is_sampled) continue;
            chart = std::move(*other);
            sampled = less;
        }
        if (!is_sampled) sampled = resampler_->sample(q, chart);
    }

    void measure_features(std::span<const uint32_t> twin) {
        const Surface& surface = quads_.surface;
        double on_border = 0, all = 0;
        for (uint32_t h = 0; h < twin.size() && !features_.empty(); ++h) {
            if (!features_.at(surface.triangles, twin, h)) continue;
            all += surface.length(h);
            if (quads_.label[h / 3] != quads_.label[twin[h] / 3]) on_border += surface.length(h);
        }
        report_.features_on_borders = all > 0 ? on_border / all : 1;
    }

    Result<void> make_charts() {
        const Stopwatch watch;
        const auto count = static_cast<uint32_t>(quads_.quads.size());
        std::vector<uint32_t> twin = quads_.surface.twins();
        auto patches = trace_charts(quads_.surface, twin, quads_.label, count, quads_.corners());
        if (!patches) return tl::unexpected(patches.error());
        patches_ = std::move(*patches);
        std::vector<std::vector<uint32_t>> members = members_of(quads_.label, count);
        for (uint32_t q = 0; q < count; ++q) {
            auto& sides = patches_.sides[q];
            if (sides.size() != 4) return fail(Fault::invariant, "quad " + std::to_string(q) + " has not four sides");
            const auto begins = [&](const Side& side) {  // at the quad's first corner
                const auto& v = patches_.arcs[side.arc].vertices;
                return (side.reversed ? v.back() : v.front()) == quads_.quads[q].corners[0];
            };
            std::rotate(sides.begin(), std::ranges::find_if(sides, begins), sides.end());
        }
        measure_features(twin);
        twin = {};
        malloc_trim(0);  // what the stages before have given back
        ChartSizes sizes = sizes_of(members);
        report_.cells = sizes.cells;
        report_.coarse_charts = count - static_cast<uint32_t>(std::ranges::count(sizes.trimmed_levels, 0));
        resampler_.emplace(mesh_, normals_, quads_.surface, patches_, sizes.cells,
                           sizes.cells * options_.attribute_ratio, std::move(sizes.trimmed_levels));
        charts_.assign(count, {});
        choose_lattice(members);
        resampler_->keep_corners_open();
        std::mutex clock_mutex;
        double parameterise_seconds = 0, resample_seconds = 0, error_seconds = 0;
        const double whole_area = std::max(quads_.surface.area(), 1e-300);
        // Those first that may have to be made anew, and with them all others: then the others need not be sampled. Of
        // either the largest first, so that no thread is left with one at the end.
        std::vector<uint32_t> order(count);
        std::iota(order.begin(), order.end(), 0u);
        std::ranges::stable_sort(order, std::greater<>(), [&](uint32_t q) {
            return std::pair<bool, size_t>(dirty_[quads_.quads[q].cluster], members[q].size());
        });
        // Some chart will be made anew and all others with it: what is left to know is which else are bad.
        bool rejected = false;
        const auto stretch_of = [](const ChartResult& c) {
            return c.figures.stretch * std::min(1.0, c.figures.spacing / close_samples);
        };
        const auto is_bad = [&](const ChartResult& c) {
            return !c.fault.empty() || c.figures.sampled.missing > 0 || stretch_of(c) > rounds_.bound();
        };
        const auto make = [&](uint32_t q) {
            const Stopwatch chart_watch;
            auto chart =
                parameterise(quads_.surface, members[q], patches_.sides[q], patches_.arcs, options_.parameterise);
            ChartResult& c = charts_[q] = {};
            if (!chart) {
                c.fault = chart.error().message;
                return;
            }
            const double parameterised = chart_watch.wall();
            c.figures.area = chart->area;
            c.figures.stretch = chart->stretch;
            const double usual = options_.clusters.clusters * usual_charts_per_cluster * chart->area / whole_area,
                         row_share = resampler_->atlas().cells_of(q) / static_cast<double>(report_.cells);
            c.figures.spacing = std::sqrt(usual) / row_share;
            c.figures.tutte_stretch = chart->tutte_stretch;
            c.figures.uniform = chart->uniform;
            c.figures.flipped = chart->patch.flipped();
            if (rejected) {
                members[q] = {};
                return;
            }
            c.figures.sampled = resampler_->sample(q, *chart);
            const Sampled as_laid_out = c.figures.sampled;
            // What unfolding did nothing for is not shear.
            if (resampler_->up() && as_laid_out.still_folded > 0 && as_laid_out.still_folded < as_laid_out.folded) {
                shear_less(q, members[q], *chart, c.figures.sampled);
                c.figures.stretch = chart->stretch;
            }
            members[q] = {};
            const double sampled = chart_watch.wall() - parameterised;
            if (c.figures.sampled.missing == 0) {
                const double share = static_cast<double>(options_.error_samples) * chart->area / whole_area;
                c.errors = measure_samples(resampler_->atlas(), q, *chart);
                c.samples = sample_source(q, *chart, std::max(fewest_samples, static_cast<uint32_t>(std::ceil(share))));
            }
            const double measured = chart_watch.wall() - parameterised - sampled;
            const std::lock_guard lock(clock_mutex);
            parameterise_seconds += parameterised;
            resample_seconds += sampled;
            error_seconds += measured;
        };
        const auto make_some = [&](std::span<const uint32_t> some, size_t done) -> Result<void> {
            parallel_for(some.size(), 1, [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end && !progress_.stopped(); ++i) {
                    make(some[i]);
                    const std::lock_guard lock(clock_mutex);
                    progress_.at("charts", static_cast<double>(done + i) / count);
                }
            });
            if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
            return {};
        };
        for (size_t first = 0; first < count; first += charts_at_once) {
            const auto some = std::span<const uint32_t>(order).subspan(first, std::min(charts_at_once, count - first));
            // What is left was good before, if not quite as it is now: the next round will tell.
            if (rejected && report_.rounds > 1 && !dirty_[quads_.quads[some.front()].cluster]) break;
            const auto look = [&] {
                rejected =
                    rejected || (!last_ && std::ranges::any_of(some, [&](uint32_t q) { return is_bad(charts_[q]); }));
            };
            const std::string name = stage("charts-" + std::to_string(first));
            if (const auto kept = work_ != nullptr ? work_->find(name) : std::nullopt;
                kept && read_charts(*kept, some, charts_, resampler_->atlas())) {
                look();
                continue;
            }
            if (auto done = make_some(some, first); !done) return done;
            look();
            if (work_ == nullptr) continue;
            auto done = work_->keep(name, [&](ChunkWriter& writer) {
                return write_checkpoint(some, charts_, resampler_->atlas(), writer);
            });
            if (!done) return done;
        }
        const auto judge = [&] {
            report_.stretched_charts = 0;
            for (uint32_t q = 0; q < count; ++q) {
                const ChartResult& c = charts_[q];
                report_.stretched_charts += stretch_of(c) > options_.worst_stretch ? 1 : 0;
                if (!is_bad(c)) continue;
                const uint32_t cluster = quads_.quads[q].cluster;
                quality_.bad[cluster] = true;
                quality_.stretch[cluster] = std::max(quality_.stretch[cluster], stretch_of(c));
                if (!c.fault.empty()) fault_ = "chart " + std::to_string(q) + ": " + c.fault;
                if (c.figures.sampled.missing > 0)
                    fault_ = "chart " + std::to_string(q) + ": samples lie in none of its triangles";
            }
        };
        judge();
        double cost = 0;
        for (const ChartResult& c : charts_) cost += RoundQuality::cost(c.figures.area, stretch_of(c), rounds_.bound());
        if (const bool improves = rounds_.improves(cost, quality_); rejected && fault_.empty() && !improves) {
            // They are taken as they are, and what was left out is sampled.
            last_ = true;
            rejected = false;
            std::erase_if(order, [&](uint32_t q) { return !charts_[q].errors.levels.empty(); });
            members = members_of(quads_.label, count);
            if (auto done = make_some(order, count - order.size()); !done) return done;
            judge();
        }
        const double share = watch.wall() / std::max(1e-9, parameterise_seconds + resample_seconds + error_seconds);
        report_.parameterise_seconds += parameterise_seconds * share;
        report_.resample_seconds += resample_seconds * share;
        report_.error_seconds += error_seconds * share;
        return {};
    }

    const TriMesh& mesh_;
    const std::span<const glm::vec3> normals_;
    const FeatureLines& features_;
    const AtlasOptions& options_;
    AtlasReport& report_;
    Refinement& rounds_;
    const Progress& progress_;
    const CheckpointFolder* work_;
    Clusters clusters_;
    RoundQuality quality_;
    std::vector<bool> dirty_;  // per cluster: templates, what was made anew, and around
    std::string fault_;
    bool last_ = false;
    Quads quads_;
    ChartComplex patches_;
    std::optional<Resampler> resampler_;
    std::vector<ChartResult> charts_;
};

}  // namespace

Result<Atlas> make_atlas(const TriMesh& source, const AtlasOptions& options, AtlasReport& report,
                         const Progress& progress, const CheckpointFolder* work) {
    LODE_CHECK(source.triangle_count() > 0 && options.cells >= 2 && options.most_rounds > 0);
    std::vector<glm::vec3> made;
    if (source.normals.empty()) made = vertex_normals(source);
    const std::span<const glm::vec3> normals = made.empty() ? source.normals : made;
    const auto surface_now = [&] {
        return surface_of(source, longest_edge(source, options.clusters.clusters), &report.changes);
    };
    Surface surface = surface_now();
    FeatureLines features = options.clusters.weights.feature > 0 ? FeatureLines(source) : FeatureLines();
    std::vector<float> density;  // 1 everywhere
    std::vector<uint32_t> kept;
    Refinement rounds(options.clusters.clusters, options.worst_stretch, source.triangle_count(), options.most_rounds);
    for (;;) {
        ++report.rounds;
        RefinementRound round(source, normals, features, options, report, rounds, progress, work);
        if (auto done = round.run(std::move(surface), density, std::move(kept)); !done)
            return tl::unexpected(done.error());
        const RoundQuality& judged = round.quality();
        // What is stretched is taken in the end, what could not be made never is.
        if (report.rounds >= options.most_rounds && !round.fault().empty())
            return fail(Fault::invariant, round.fault());
        if ((round.is_last() && round.fault().empty()) || std::ranges::find(judged.bad, true) == judged.bad.end()) {
            auto atlas = round.take();
            if (atlas) atlas->attributes = attributes_of(source);
            return atlas;
        }
        // There clusters become finer, and borders need not be kept on features any more.
        surface = surface_now();
        density.resize(surface.triangles.size(), 1.0f);
        const std::vector<double> times = rounds.times_denser(
            judged, wanted_of(surface, density, round.label(), judged.bad.size(), options.clusters.clusters));
        std::vector<bool> forgotten(source.triangle_count(), false);
        for (uint32_t t = 0; t < density.size(); ++t) {
            const uint32_t cluster = round.label()[t];
            if (!judged.bad[cluster]) continue;
            density[t] *= static_cast<float>(times[cluster]);
            forgotten[surface.triangles[t].source] = true;
        }
        features.forget(forgotten);
        kept = kept_clusters(surface, round.label(), judged.bad);
    }
}

}  // namespace lodestone::vgi
