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
#include "vgi/bake/charts/refinement.h"
#include "vgi/bake/checkpoints.h"
#include "vgi/bake/images/baked_looks.h"
#include "vgi/bake/images/chart_error.h"
#include "vgi/bake/images/chart_sizes.h"
#include "vgi/bake/images/corners/collapse_corners.h"
#include "vgi/bake/images/resample.h"
#include "vgi/bake/images/sample_errors.h"
#include "vgi/bake/quads/quadrangulate.h"

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
constexpr uint32_t rounds_of_faults = 5;  // after most_rounds, while charts cannot be made at all
constexpr uint32_t fewest_samples = 32;   // of a chart's distance to the source

// A hash of everything that stages depend on besides the mesh: stages of other options have other names. A field that
// is added to one of these structs does not compile until it is listed here.
Hash128 key_of(const AtlasOptions& options) {
    const auto& [clusters, parameterise, cells, most_texels_per_triangle, rounding_share, attribute_ratio,
                 worst_stretch, most_rounds, recentre_passes, error_samples, leaves, samples_per_triangle,
                 bake_textures, texture_quality] = options;
    // Every round sets the density, the features and the kept clusters itself.
    const auto& [wanted, weights, bucket_triangles, density, features, kept] = clusters;
    const auto& [planarity, compactness, size, irregularity, curvature, feature, bulge] = weights;
    const auto& [most_solves, least_gain, curvature_importance, sliding_sides] = parameterise;
    const double reals[] = {most_texels_per_triangle,
                            rounding_share,
                            worst_stretch,
                            planarity,
                            compactness,
                            size,
                            irregularity,
                            curvature,
                            feature,
                            bulge,
                            least_gain,
                            curvature_importance,
                            samples_per_triangle};
    const uint64_t counts[] = {cells,         attribute_ratio, most_rounds,      recentre_passes,
                               error_samples, wanted,          bucket_triangles, most_solves,
                               sliding_sides, leaves,          bake_textures,    texture_quality};
    HashStream all;
    all.add(std::as_bytes(std::span(reals)));
    all.add(std::as_bytes(std::span(counts)));
    return all.digest();
}

// How far a chart is stretched, as far as it counts.
double counted_stretch(const ChartResult& chart) {
    return chart.figures.stretch * std::min(1.0, chart.figures.spacing / close_samples);
}

// What all rounds have in common. It outlives them.
struct RoundContext {
    const TriMesh& mesh;
    std::span<const glm::vec3> normals;  // per wedge
    const AtlasOptions& options;
    const Progress& progress;
    const CheckpointFolder* work;  // null for none
    const BakedLooks* looks;       // null where textures are not baked
    const Limits& limits;
    std::string key = key_of(options).hex().substr(0, 16);
};

// One round: clusters, quads and charts of a surface with a density of clusters.
class RefinementRound {
public:
    RefinementRound(const RoundContext& context, const FeatureLines& features, AtlasReport& report, Refinement& rounds)
        : context_(context),
          mesh_(context.mesh),
          options_(context.options),
          progress_(context.progress),
          work_(context.work),
          features_(features),
          report_(report),
          rounds_(rounds) {}

    // What is wrong with its clusters goes to quality(), `fault` says it of the last that could not be made.
    Result<void> run(Surface surface, const std::vector<float>& density, std::vector<uint32_t> kept) {
        if (auto done = cluster(surface, density, std::move(kept)); !done) return done;
        if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        rounds_.begin(report_.clusters);
        auto straight = load_or_make<StraightQuads>(
            work_, stage("quads"), read_quads, [&] { return make_quads(std::move(surface)); },
            [](const StraightQuads& made, ChunkWriter& writer) { return write_checkpoint(made, writer); });
        if (!straight) return tl::unexpected(straight.error());
        quads_ = std::move(straight->quads);
        rounds_.cut(quads_.surface.triangles.size());
        last_ = rounds_.is_last();
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
    // Per chart (chart_sizes.h); empty where no textures are baked.
    const std::vector<double>& texel_samples() const { return samples_per_texel_; }
    const std::string& fault() const { return fault_; }
    // Whether stretched charts are taken as they are.
    bool is_last() const { return last_; }

    Result<Atlas> take() {
        report_charts();
        if (report_.missing_samples > 0)
            return fail(Fault::invariant, std::to_string(report_.missing_samples) + " samples lie in no triangle");
        std::vector<SourceSample> samples;
        std::vector<std::vector<double>> page_errors;
        for (const ChartResult& made : charts_) {
            page_errors.push_back(made.errors.pages);
            samples.insert(samples.end(), made.samples.begin(), made.samples.end());
            report_.charts_without_leaves += made.lacks_leaves() ? 1 : 0;
        }
        const std::vector<float> errors = errors_of_levels();
        Atlas atlas = resampler_->take();
        std::ranges::transform(quads_.quads, atlas.cluster.begin(), &Quads::Quad::cluster);
        atlas.errors = errors;
        if (options_.leaves) take_leaves(leaves_of_charts(), atlas);
        quads_ = {};
        patches_ = {};
        charts_ = {};
        const Stopwatch watch;
        progress_.at("errors", 0);
        saturate(atlas);
        if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        bound_pages(atlas, page_errors);
        collapse_corners(atlas, progress_);
        if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        progress_.at("distance", 0);
        const AtlasDistance finest = measure_finest(atlas, mesh_, samples);
        report_.rms_error = finest.rms;
        report_.max_error = finest.max;
        report_.error_seconds += watch.wall();
        return atlas;
    }

private:
    // The name in the work folder of what this round makes with these options.
    std::string stage(const std::string& what) const {
        return "atlas-" + context_.key + "-" + std::to_string(report_.rounds) + "-" + what;
    }

    Result<void> cluster(const Surface& surface, const std::vector<float>& density, std::vector<uint32_t> kept) {
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
        return {};
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
        auto cut = quadrangulate(std::move(surface), clusters_, progress_);
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
            auto left = recentre(made.quads, pivot, features_, progress_);
            if (!left) return tl::unexpected(left.error());
            made.not_recentred += *left;
        }
        report_.straighten_seconds += straighten_watch.wall();
        return made;
    }

    // Of images that hold everything.
    ChartSizes whole_sizes(const std::vector<std::vector<uint32_t>>& members) const {
        constexpr double charts_per_cluster = 2 * usual_charts_per_cluster;  // of clusters wanted
        const double row = options_.cells + 1,
                     most = std::max(options_.most_texels_per_triangle * static_cast<double>(mesh_.triangle_count()),
                                     charts_per_cluster * options_.clusters.clusters * row * row);
        return chart_sizes(quads_.surface, members, patches_, {options_.clusters.clusters, options_.cells, most});
    }
    // Of positions, no denser than the source asks for.
    ChartSizes sizes_by_source(const std::vector<std::vector<uint32_t>>& members, uint32_t cells) const {
        const double density = options_.samples_per_triangle;
        if (options_.leaves)
            return sizes_by_triangles(triangles_of_charts(), patches_, {options_.clusters.clusters, cells, 0, density});
        return chart_sizes(
            quads_.surface, members, patches_,
            {options_.clusters.clusters, cells, density * static_cast<double>(mesh_.triangle_count()), density});
    }
    // Of each chart the sum over the source's triangles of what they have, by the parts of them that are in it.
    template <class Amount>
    std::vector<double> share_out(const Amount& amount) const {
        std::vector<double> areas(mesh_.triangle_count());
        for (uint32_t t = 0; t < quads_.label.size(); ++t)
            areas[quads_.surface.triangles[t].source] += quads_.surface.area(t);
        std::vector<double> sums(quads_.quads.size(), 0);
        for (uint32_t t = 0; t < quads_.label.size(); ++t) {
            const uint32_t source = quads_.surface.triangles[t].source;
            if (areas[source] > 0) sums[quads_.label[t]] += amount(source) * quads_.surface.area(t) / areas[source];
        }
        return sums;
    }
    std::vector<double> triangles_of_charts() const {
        return share_out([](uint32_t) { return 1.0; });
    }
    // Texels that triangles of each chart use.
    std::vector<double> texels_of_charts() const {
        return share_out([&](uint32_t source) { return context_.looks->texels(source); });
    }
    // Of images of attributes. whole: cells of images that hold everything.
    ChartSizes attribute_sizes(const ChartSizes& positions, uint32_t whole) {
        ChartSizes alike{positions.cells * attribute_ratio(positions.cells, whole), positions.trimmed_levels};
        if (context_.looks == nullptr) return with_depths_of(positions, std::move(alike));
        const std::vector<double> texels = texels_of_charts();
        ChartSizes sizes = options_.attribute_ratio > 1 ? alike : texture_sizes(texels, patches_, positions);
        samples_per_texel_ = samples_per_texel(texels, patches_, sizes);
        return sizes;
    }
    // Attributes end where positions do, where charts have one page of them.
    static ChartSizes with_depths_of(const ChartSizes& positions, ChartSizes sizes) {
        constexpr uint32_t fewest_cells = 4;
        for (uint32_t c = 0; c < positions.unsampled_levels.size(); ++c) {
            const uint32_t cells = sizes.cells >> sizes.trimmed_levels[c];
            uint32_t levels = cells > page_cells ? 0 : positions.unsampled_levels[c];
            while (levels > 0 && cells >> levels < fewest_cells) --levels;
            sizes.unsampled_levels.push_back(static_cast<uint8_t>(levels));
        }
        return sizes;
    }
    // Of attributes for one of positions, along a side, unless textures say how many.
    uint32_t attribute_ratio(uint32_t cells, uint32_t whole) const {
        const uint32_t finer = whole / cells;
        if (context_.looks != nullptr) return options_.attribute_ratio;
        const bool has_textures = !mesh_.uvs.empty() && !mesh_.images.empty();
        if (has_textures || !mesh_.materials.empty()) return finer * options_.attribute_ratio;
        return std::min(finer, mesh_.colours.empty() ? 1u : 2u) * options_.attribute_ratio;
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

    // All charts of the quads; which are bad goes to quality().
    Result<void> make_charts() {
        const Stopwatch watch;
        if (auto done = trace_sides(); !done) return done;
        prepare_images();
        order_charts();
        if (auto done = make_in_portions(); !done) return done;
        judge_charts();
        const double cost = cost_of_charts();
        const bool improves = rounds_.improves(cost, quality_),
                   little = options_.leaves && rounds_.leaves_little(cost / whole_area_, quality_);
        if (rejected_ && fault_.empty() && (little || !improves)) {
            // The bad charts are taken as they are, and those that were left out are sampled.
            last_ = true;
            rejected_ = false;
            std::erase_if(order_, [&](uint32_t q) { return !charts_[q].errors.levels.empty(); });
            members_ = members_of(quads_.label, static_cast<uint32_t>(charts_.size()));
            if (auto done = make_some(order_, charts_.size() - order_.size()); !done) return done;
            judge_charts();
        }
        members_ = {};
        order_ = {};
        // Charts are made side by side: each step has its share of the wall clock.
        const double share = watch.wall() / std::max(1e-9, seconds_.parameterise + seconds_.resample + seconds_.error);
        report_.parameterise_seconds += seconds_.parameterise * share;
        report_.resample_seconds += seconds_.resample * share;
        report_.error_seconds += seconds_.error * share;
        return {};
    }

    // Traces the sides of all quads; those of a quad begin at its first corner.
    Result<void> trace_sides() {
        const auto count = static_cast<uint32_t>(quads_.quads.size());
        if (count > context_.limits.charts)
            return fail(Fault::format, "the atlas has " + std::to_string(count) + " charts; the limit is " +
                                           std::to_string(context_.limits.charts) + "; bake with fewer clusters");
        const std::vector<uint32_t> twin = quads_.surface.twins();
        auto patches = trace_charts(quads_.surface, twin, quads_.label, count, quads_.corners());
        if (!patches) return tl::unexpected(patches.error());
        patches_ = std::move(*patches);
        for (uint32_t q = 0; q < count; ++q) {
            auto& sides = patches_.sides[q];
            if (sides.size() != 4) return fail(Fault::invariant, "quad " + std::to_string(q) + " has not four sides");
            const auto begins = [&](const Side& side) { return patches_.begin_of(side) == quads_.quads[q].corners[0]; };
            std::rotate(sides.begin(), std::ranges::find_if(sides, begins), sides.end());
        }
        measure_features(twin);
        return {};
    }

    // Sizes and lattice of the images.
    void prepare_images() {
        const auto count = static_cast<uint32_t>(quads_.quads.size());
        members_ = members_of(quads_.label, count);
        whole_area_ = std::max(quads_.surface.area(), 1e-300);
        malloc_trim(0);  // what the stages before have given back
        ChartSizes sizes = whole_sizes(members_);
        const uint32_t whole = sizes.cells;
        if (options_.samples_per_triangle > 0) sizes = sizes_by_source(members_, whole);
        report_.cells = sizes.cells;
        report_.coarse_charts = 0;
        for (uint32_t c = 0; c < count; ++c)
            report_.coarse_charts += sizes.trimmed_levels[c] + sizes.levels_of(c) > 0 ? 1 : 0;
        ChartSizes attributes = attribute_sizes(sizes, whole);
        resampler_.emplace(ResampleInput{mesh_, context_.normals, quads_.surface, patches_, context_.looks},
                           std::move(sizes), std::move(attributes));
        charts_.assign(count, {});
        choose_lattice(members_);
        resampler_->keep_corners_open();
    }

    // Charts that may be bad come first: once one is, all charts are made anew, and the others need not be sampled.
    // Of either kind the largest come first, so that no thread is left with one at the end.
    void order_charts() {
        order_.resize(charts_.size());
        std::iota(order_.begin(), order_.end(), 0u);
        std::ranges::stable_sort(order_, std::greater<>(),
                                 [&](uint32_t q) { return std::pair<bool, size_t>(is_dirty(q), members_[q].size()); });
    }

    Result<void> make_in_portions() {
        for (size_t first = 0; first < order_.size(); first += charts_at_once) {
            const auto some =
                std::span<const uint32_t>(order_).subspan(first, std::min(charts_at_once, order_.size() - first));
            // The charts that are left were good before, if not quite as they are now: the next round will tell.
            if (rejected_ && report_.rounds > 1 && !is_dirty(some.front())) break;
            if (auto done = load_or_make_portion(some, first); !done) return done;
            rejected_ =
                rejected_ || (!last_ && std::ranges::any_of(some, [&](uint32_t q) { return is_bad(charts_[q]); }));
        }
        return {};
    }

    Result<void> load_or_make_portion(std::span<const uint32_t> some, size_t first) {
        if (work_ == nullptr) return make_some(some, first);
        const std::string name = stage("charts-" + std::to_string(first));
        if (const auto kept = work_->find(name); kept && read_charts(*kept, some, charts_, resampler_->atlas()))
            return {};
        if (auto done = make_some(some, first); !done) return done;
        return work_->keep(
            name, [&](ChunkWriter& writer) { return write_checkpoint(some, charts_, resampler_->atlas(), writer); });
    }

    // done: how many charts have been made before.
    Result<void> make_some(std::span<const uint32_t> some, size_t done) {
        parallel_for(some.size(), 1, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end && !progress_.stopped(); ++i) {
                const StepSeconds seconds = make_chart(some[i]);
                const std::lock_guard lock(seconds_mutex_);
                seconds_.parameterise += seconds.parameterise;
                seconds_.resample += seconds.resample;
                seconds_.error += seconds.error;
                progress_.at("charts", static_cast<double>(done + i) / static_cast<double>(charts_.size()));
            }
        });
        if (progress_.stopped()) return fail(Fault::interrupted, "interrupted");
        return {};
    }

    struct StepSeconds {
        double parameterise = 0, resample = 0, error = 0;
    };

    StepSeconds make_chart(uint32_t q) {
        const Stopwatch watch;
        auto chart = parameterise(quads_.surface, members_[q], patches_.sides[q], patches_.arcs, options_.parameterise);
        ChartResult& made = charts_[q] = {};
        if (!chart) {
            made.fault = chart.error().message;
            return {};
        }
        StepSeconds seconds;
        seconds.parameterise = watch.wall();
        measure_layout(q, *chart, made.figures);
        if (!rejected_) {
            sample_chart(q, *chart, made.figures);
            seconds.resample = watch.wall() - seconds.parameterise;
            if (made.figures.sampled.missing == 0) measure_chart(q, *chart, made);
            seconds.error = watch.wall() - seconds.parameterise - seconds.resample;
        }
        members_[q] = {};
        return seconds;
    }

    // Of places, not of samples: a chart without samples of the finest levels has no detail there to lose.
    void measure_layout(uint32_t q, const Chart& chart, ChartResult::Figures& figures) const {
        figures.area = chart.area;
        figures.stretch = chart.stretch;
        const double usual = options_.clusters.clusters * usual_charts_per_cluster * chart.area / whole_area_,
                     row_share = resampler_->atlas().cells_of(q) / static_cast<double>(report_.cells);
        figures.spacing = std::sqrt(usual) / row_share;
        figures.tutte_stretch = chart.tutte_stretch;
        figures.uniform = chart.uniform;
        figures.flipped = chart.patch.flipped();
    }

    void sample_chart(uint32_t q, Chart& chart, ChartResult::Figures& figures) {
        figures.sampled = resampler_->sample(q, chart);
        const Sampled as_laid_out = figures.sampled;
        // If untangling has gained nothing, shear is not what folds the samples.
        if (resampler_->up() && as_laid_out.still_folded > 0 && as_laid_out.still_folded < as_laid_out.folded) {
            shear_less(q, members_[q], chart, figures.sampled);
            figures.stretch = chart.stretch;
        }
    }

    // The errors of its images, and samples of the source for its distance.
    void measure_chart(uint32_t q, const Chart& chart, ChartResult& made) {
        const double share = static_cast<double>(options_.error_samples) * chart.area / whole_area_;
        made.errors = measure_samples(resampler_->atlas(), resampler_->depths(), q, chart);
        made.samples = sample_source(q, chart, std::max(fewest_samples, static_cast<uint32_t>(std::ceil(share))));
        if (options_.leaves)
            made.leaves = make_leaves(resampler_->input(), resampler_->atlas(), resampler_->depths(), q, chart);
    }

    void judge_charts() {
        report_.stretched_charts = 0;
        for (uint32_t q = 0; q < charts_.size(); ++q) {
            const ChartResult& c = charts_[q];
            report_.stretched_charts += counted_stretch(c) > options_.worst_stretch ? 1 : 0;
            if (!is_bad(c)) continue;
            const uint32_t cluster = quads_.quads[q].cluster;
            quality_.bad[cluster] = true;
            quality_.stretch[cluster] = std::max(quality_.stretch[cluster], counted_stretch(c));
            if (!c.fault.empty()) fault_ = "chart " + std::to_string(q) + ": " + c.fault;
            if (c.figures.sampled.missing > 0)
                fault_ = "chart " + std::to_string(q) + ": samples lie in none of its triangles";
        }
    }

    double cost_of_charts() const {
        double cost = 0;
        for (const ChartResult& c : charts_)
            cost += RoundQuality::cost(c.figures.area, counted_stretch(c), rounds_.bound());
        return cost;
    }

    bool is_bad(const ChartResult& c) const {
        return !c.fault.empty() || c.figures.sampled.missing > 0 || counted_stretch(c) > rounds_.bound();
    }
    bool is_dirty(uint32_t q) const { return dirty_[quads_.quads[q].cluster]; }

    // Sums and extremes over all charts.
    void report_charts() {
        report_.l2_stretch_worst = 0;
        report_.missing_samples = report_.flipped_triangles = report_.uniform_charts = 0;
        report_.folded_cells = report_.still_folded_cells = 0;
        double area = 0, tutte = 0, stretch = 0;
        for (const ChartResult& made : charts_) {
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
        }
        report_.charts = static_cast<uint32_t>(charts_.size());
        report_.l2_stretch_tutte = area > 0 ? std::sqrt(tutte / area) : 1;
        report_.l2_stretch_rms = area > 0 ? std::sqrt(stretch / area) : 1;
    }

    std::vector<ChartLeaves> leaves_of_charts() {
        std::vector<ChartLeaves> all;
        for (ChartResult& made : charts_) all.push_back(std::move(made.leaves));
        return all;
    }

    // Per level the largest error of sampling among the charts, never decreasing.
    std::vector<float> errors_of_levels() {
        const Atlas& atlas = resampler_->atlas();
        std::vector<double> largest_of(atlas.levels(), 0);
        for (uint32_t q = 0; q < charts_.size(); ++q) {
            const std::vector<double>& levels = charts_[q].errors.levels;
            for (uint32_t level = 0; level < largest_of.size() && !levels.empty(); ++level)
                largest_of[level] = std::max(largest_of[level], levels[atlas.own_level(q, level)]);
            // Where a side is coarser than the chart, more samples than those of finer levels are not there.
            if (resampler_->depths().is_even(atlas, q)) continue;
            for (const double error : charts_[q].leaves.errors) largest_of[0] = std::max(largest_of[0], error);
        }
        std::vector<float> errors;
        double largest = 0;
        for (const double error : largest_of) {
            largest = std::max(largest, error);
            errors.push_back(static_cast<float>(largest * sampling_margin));
        }
        return errors;
    }

    const RoundContext& context_;
    const TriMesh& mesh_;
    const AtlasOptions& options_;
    const Progress& progress_;
    const CheckpointFolder* const work_;
    const FeatureLines& features_;
    AtlasReport& report_;
    Refinement& rounds_;
    Clusters clusters_;
    RoundQuality quality_;
    std::vector<bool> dirty_;  // per cluster: templates, what was made anew, and around
    std::string fault_;
    bool last_ = false;
    // Some chart is bad, so all will be made anew: it is only left to know which others are bad.
    bool rejected_ = false;
    Quads quads_;
    ChartComplex patches_;
    std::vector<std::vector<uint32_t>> members_;  // triangles per chart, until it is made
    std::vector<uint32_t> order_;                 // in which charts are made
    std::vector<double> samples_per_texel_;       // per chart
    std::optional<Resampler> resampler_;
    std::vector<ChartResult> charts_;
    double whole_area_ = 0;  // of the surface
    std::mutex seconds_mutex_;
    StepSeconds seconds_;  // of all threads
};

// Charts have a power of two of cells, so their finest level has up to four times as many samples as it needs, or more
// where that was asked for. What it is off by over a texel would be as on other levels with a step larger by the square
// root of samples for each. It is larger by a good half of that, as one sample may fill a pixel.
// samples: per chart, for a texel.
void set_quality(Atlas& atlas, uint32_t quality, std::span<const double> samples) {
    constexpr double most_below = 6, below_a_doubling = 3;  // a step twice as large is 10 below
    constexpr double many = 1.4;
    atlas.attributes.texture_quality = atlas.attributes.dense_quality = static_cast<uint8_t>(quality);
    if (quality == 0) return;
    double cells = 0, texels = 0;  // of what is dense
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        if (samples[c] < many) continue;
        atlas.dense[c] = 1;
        const double own = std::pow(atlas.attribute_cells_of(c), 2);
        cells += own;
        texels += own / samples[c];
    }
    if (cells == 0) return;
    const auto below = static_cast<uint32_t>(std::min(below_a_doubling * std::log2(cells / texels), most_below));
    atlas.attributes.dense_quality = static_cast<uint8_t>(std::max(quality, below + 1) - below);
}

// Makes bad clusters finer; borders need not be kept on features there any more. times: per cluster, how much finer.
void make_denser(const RoundContext& context, const Surface& surface, const RefinementRound& round,
                 const std::vector<double>& times, std::vector<float>& density, FeatureLines& features) {
    std::vector<bool> forgotten(context.mesh.triangle_count(), false);
    for (uint32_t t = 0; t < density.size(); ++t) {
        const uint32_t cluster = round.label()[t];
        if (!round.quality().bad[cluster]) continue;
        density[t] *= static_cast<float>(times[cluster]);
        forgotten[surface.triangles[t].source] = true;
    }
    features.forget(forgotten);
}

}  // namespace

Result<Atlas> make_atlas(const TriMesh& source, const AtlasOptions& options, AtlasReport& report,
                         const Progress& progress, const CheckpointFolder* work, const Limits& limits) {
    LODE_CHECK(source.triangle_count() > 0 && options.cells >= 2 && options.most_rounds > 0);
    std::vector<glm::vec3> made;
    if (source.normals.empty()) made = vertex_normals(source);
    const std::span<const glm::vec3> normals = made.empty() ? source.normals : made;
    std::optional<BakedLooks> looks;
    if (options.bake_textures || must_bake_textures(source)) looks.emplace(source, normals);
    const bool bakes = looks && looks->attributes().baked;
    const RoundContext context{source, normals, options, progress, work, bakes ? &*looks : nullptr, limits};
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
        RefinementRound round(context, features, report, rounds);
        if (auto done = round.run(std::move(surface), density, std::move(kept)); !done)
            return tl::unexpected(done.error());
        const std::vector<bool>& bad = round.quality().bad;
        // What is stretched is taken in the end, what could not be made never is: that has some rounds more.
        if (report.rounds >= options.most_rounds + rounds_of_faults && !round.fault().empty())
            return fail(Fault::invariant, round.fault());
        if ((round.is_last() && round.fault().empty()) || std::ranges::find(bad, true) == bad.end()) {
            auto atlas = round.take();
            if (atlas) atlas->attributes = attributes_of_atlas(source, context.looks);
            if (atlas && bakes) set_quality(*atlas, options.texture_quality, round.texel_samples());
            if (atlas && bakes) agree_on_borders(*atlas);
            return atlas;
        }
        surface = surface_now();
        density.resize(surface.triangles.size(), 1.0f);
        const std::vector<double> times = rounds.times_denser(
            round.quality(), wanted_where(surface, density, round.label(), bad.size(), options.clusters.clusters));
        make_denser(context, surface, round, times, density, features);
        kept = kept_clusters(surface, round.label(), bad);
    }
}

}  // namespace lodestone::vgi
