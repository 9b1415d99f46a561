#include "lod/bake/orders/keyframe_order.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <utility>

#include "base/check.h"
#include "base/none.h"
#include "base/threads.h"
#include "lod/bake/orders/cluster_order.h"
#include "lod/bake/orders/fan_order.h"

namespace lodestone {

namespace {

// Below this many faces an order is not worth a permutation.
constexpr size_t least_faces = 12;
// Levels of an interval at which its candidates are compared, the first and the last among them.
constexpr size_t samples = 4;

// The sample at which transforms count as well when looking ahead.
constexpr size_t later_sample = 2;
// How the best candidate looks ahead.
constexpr Rollouts rollouts{6, 90, 3};
// Keyframes are ordered side by side in groups of so many faces in all, of those of the first.
constexpr size_t group_faces = 4;
// Seconds per face of one keyframe on two cores, for all candidates and for looking ahead; to keep to
// OrderOptions::seconds.
constexpr double plain_seconds = 3e-6, look_ahead_seconds = 5e-6;

// Clusters: annealing, and its seconds per face and sweep and those of drawing the clusters.
constexpr double most_sweeps_in_all = 1800;  // over all keyframes, in units of the first
constexpr uint32_t fewest_sweeps = 12;
constexpr double sweep_seconds = 0.03e-6, careful_seconds = 2e-6, careless_seconds = 1e-6;

struct Candidate {
    uint32_t cache;
    FanWeights weights;
};

// As far as the order of faces goes: indices near to each other are what places are for (vertex_places.h).
CacheModel for_order(CacheModel model) {
    model.batch_index_bits = 0;
    return model;
}

// Sizes around the real one: an order made for a smaller cache loses less when gaps open.
std::vector<Candidate> candidates_for(const CacheModel& model) {
    std::vector<uint32_t> sizes;
    if (model.kind == CacheModel::Kind::batch) {
        // Whatever is cached is lost when a batch closes, so shorter memories are tried too.
        for (const double share : {1.0, 0.93, 0.86, 0.75, 0.6, 0.45})
            sizes.push_back(std::max(6u, static_cast<uint32_t>(share * model.size)));
    } else {
        for (const uint32_t less : {0u, 1u, 2u, 3u, 5u}) {
            if (model.size >= less + 4) sizes.push_back(model.size - less);
        }
    }
    std::vector<Candidate> all;
    for (const uint32_t size : sizes) {
        all.push_back({size, large_fans});
        all.push_back({size, small_fans});
    }
    return all;
}

// Batches of so few triangles want clusters; in larger ones fans do better.
bool in_clusters(const CacheModel& model) {
    return model.kind == CacheModel::Kind::batch && model.batch_triangles > 0 && model.batch_triangles <= 64;
}

// The share r of faces still alive at which the next keyframe comes. Of n slots, r n are written anew, and (1 - r) n /
// 2 collapses bring that about: 2 r / (1 - r) moves each.
double ratio_for(double moves_per_ecol) { return moves_per_ecol / (2 + moves_per_ecol); }

class KeyframeOrderer final : public FaceOrderer {
public:
    explicit KeyframeOrderer(const OrderOptions& options)
        : model_(for_order(options.cache)),
          ratio_(ratio_for(0.98 * options.moves_per_ecol)),  // what small intervals add
          seconds_(options.seconds),
          stop_(options.stop),
          candidates_(candidates_for(options.cache)) {}

    std::string name() const override { return "keyframe"; }

    std::vector<uint32_t> first_order(const OrderInput& input) override {
        input_ = input;
        plan_search(input.death.size());
        alive_at_.assign(size_t{input.levels} + 1, 0);
        for (const uint32_t death : input.death) ++alive_at_[death];
        // From deaths at each level to faces alive at it: those that die later.
        uint32_t later = 0;
        for (size_t level = alive_at_.size(); level-- > 0;) {
            const uint32_t dying = alive_at_[level];
            alive_at_[level] = later;
            later += dying;
        }
        std::vector<uint32_t> faces(input.death.size());
        std::iota(faces.begin(), faces.end(), 0u);
        if (in_clusters(model_)) {
            order_in_clusters(0, input.indices, {}, faces);
        } else {
            faces = order_in_fans(interval_from(0, std::move(faces), input.indices));
        }
        return faces;
    }

    bool wants_order(uint32_t, uint32_t alive, uint32_t slots) override {
        return alive >= least_faces && alive <= ratio_ * slots;
    }

    void reorder(uint32_t level, std::span<const uint32_t> indices, std::span<const uint32_t> slots,
                 std::vector<uint32_t>& alive_faces) override {
        if (in_clusters(model_)) {
            order_in_clusters(level, indices, slots, alive_faces);
            return;
        }
        if (coming_.empty()) order_group(level, indices, alive_faces);
        LODE_CHECK(coming_.back().level == level, coming_.back().level, level);
        alive_faces = std::move(coming_.back().faces);
        coming_.pop_back();
    }

    bool searched_less() const override { return searched_less_; }

private:
    // How much is searched, so that an order of a mesh of so many faces keeps to its seconds. By size and not by the
    // clock, so that the order is the same on every machine. Keyframes of n, r n, r^2 n, ... faces: n / (1 - r) in all.
    void plan_search(size_t faces) {
        const double all = static_cast<double>(faces) / (1 - ratio_);
        if (in_clusters(model_)) {
            const double per_face = seconds_ / std::max(all, 1.0);
            careful_ = per_face > 2 * careful_seconds;
            const double left = per_face - (careful_ ? careful_seconds : careless_seconds);
            const double most = most_sweeps_in_all * (1 - ratio_);
            sweeps_ = static_cast<uint32_t>(std::clamp(left / sweep_seconds, double{fewest_sweeps}, most));
            searched_less_ = !careful_ || left / sweep_seconds < most;
        } else {
            const double left = seconds_ - plain_seconds * all;
            look_ahead_below_ = std::max(0.0, left) / look_ahead_seconds * (1 - ratio_);
            searched_less_ = static_cast<double>(faces) > look_ahead_below_;
        }
    }

    // Then orders are thrown away, so any will do.
    bool told_to_stop() const { return stop_ != nullptr && stop_->load(std::memory_order_relaxed); }

    // The levels that an order serves.
    struct Interval {
        uint32_t level, end;            // the first and the last
        std::vector<uint32_t> faces;    // alive at the first
        std::vector<uint32_t> indices;  // their wedges then, three per face
    };
    // The one that begins at a level. indices: three wedges per face of the mesh, not coarser than the level.
    Interval interval_from(uint32_t level, std::vector<uint32_t> faces, std::span<const uint32_t> indices) const {
        Interval interval{level, last_level(level, faces.size()), std::move(faces), {}};
        interval.indices.reserve(interval.faces.size() * 3);
        for (const uint32_t f : interval.faces) {
            for (uint32_t k = 0; k < 3; ++k)
                interval.indices.push_back(input_.ancestor(indices[size_t{f} * 3 + k], level));
        }
        return interval;
    }
    uint32_t last_level(uint32_t level, size_t faces) const {
        while (level + 1 < input_.levels && alive_at_[level] > ratio_ * static_cast<double>(faces)) ++level;
        return level;
    }
    // The interval after one; none behind the last.
    std::optional<Interval> interval_after(const Interval& before) const {
        // Two levels running have no keyframes.
        uint32_t level = before.level + 2;
        while (level < input_.levels && alive_at_[level] > ratio_ * static_cast<double>(before.faces.size())) ++level;
        if (level >= input_.levels || alive_at_[level] < least_faces) return std::nullopt;
        Interval next{level, 0, {}, {}};
        for (size_t i = 0; i < before.faces.size(); ++i) {
            if (input_.death[before.faces[i]] <= level) continue;
            next.faces.push_back(before.faces[i]);
            for (size_t k = 0; k < 3; ++k) next.indices.push_back(input_.ancestor(before.indices[i * 3 + k], level));
        }
        next.end = last_level(level, next.faces.size());
        return next;
    }

    // The orders of the interval at `level` and of some after it, into coming_. Each is made from the faces alone and
    // not from the order before, so that they are made side by side.
    void order_group(uint32_t level, std::span<const uint32_t> indices, const std::vector<uint32_t>& faces) {
        coming_.push_back(interval_from(level, faces, indices));
        for (size_t sum = faces.size(); sum <= group_faces * faces.size() && !told_to_stop();) {
            auto next = interval_after(coming_.back());
            if (!next) break;
            sum += next->faces.size();
            coming_.push_back(std::move(*next));
        }
        parallel_for(coming_.size(), 1, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                coming_[i].faces = order_in_fans(coming_[i]);
                coming_[i].indices = {};
            }
        });
        std::ranges::reverse(coming_);
    }

    // The faces of an interval by the candidate that costs least over it.
    std::vector<uint32_t> order_in_fans(const Interval& interval) const {
        if (interval.faces.empty()) return {};
        Samples all;
        uint32_t wedges = 0;
        for (const uint32_t w : interval.indices) wedges = std::max(wedges, w + 1);
        all.number.assign(wedges, none);
        for (size_t s = 0; s < samples; ++s) {
            if (told_to_stop()) return interval.faces;
            all.at[s] = sample(interval, s);
            all.distinct[s] = number_by_use(all.at[s], s, all);
        }
        Fans fans(all.at[0], all.vertices);
        fans.stop = stop_;
        const bool looks_ahead = static_cast<double>(interval.faces.size()) <= look_ahead_below_;
        std::vector<Trial> trials;
        for (const Candidate& c : candidates_) trials.push_back({c, {}, {}, 0});
        // A FIFO's own size looks ahead best; which memory a batch has is tried out.
        if (looks_ahead && model_.kind != CacheModel::Kind::batch) trials.resize(1);
        if (!looks_ahead || trials.size() > 1) make(trials, fans, all);
        Trial& best = *std::ranges::min_element(trials, {}, &Trial::cost);
        if (looks_ahead) {
            std::vector<Trial> ahead{{best.candidate, rollouts, {}, 0}};
            ahead[0].rollouts.later = all.at[later_sample];
            make(ahead, fans, all);
            if (best.order.empty() || ahead[0].cost < best.cost) best = std::move(ahead[0]);
        }
        if (told_to_stop()) return interval.faces;
        std::vector<uint32_t> sorted;
        sorted.reserve(interval.faces.size());
        for (const uint32_t i : best.order) sorted.push_back(interval.faces[i]);
        return sorted;
    }

    void order_in_clusters(uint32_t level, std::span<const uint32_t> indices, std::span<const uint32_t> slots,
                           std::vector<uint32_t>& faces) const {
        if (faces.empty()) return;
        // By its first level and a later one: one alone ages twice as fast, more bring little.
        constexpr std::array<double, 2> weights{0.5, 0.5};
        const Interval interval = interval_from(level, std::move(faces), indices);
        const std::array<std::vector<uint32_t>, 2> levels{sample(interval, 0), sample(interval, 2)};
        ClusterOrderOptions options;
        options.batch_faces = model_.batch_triangles;
        options.batch_vertices = model_.batch_vertices;
        options.sweeps = sweeps_;
        options.careful = careful_;
        options.stop = stop_;
        faces.clear();
        faces.reserve(interval.faces.size());
        for (const uint32_t i : cluster_order(levels, weights, input_.wedges, options, slots))
            faces.push_back(interval.faces[i]);
    }

    // The faces at each sample by numbers of wedges below `vertices`, and how many different ones each has.
    struct Samples {
        std::array<std::vector<uint32_t>, samples> at;
        std::array<double, samples> distinct{};
        uint32_t vertices = 0;
        std::vector<uint32_t> number, used_by;  // of wedges; per number: the last sample that has it
    };
    struct Trial {
        Candidate candidate;
        Rollouts rollouts;
        std::vector<uint32_t> order;
        double cost = 0;  // sum over the samples of transforms per vertex
    };
    void make(std::vector<Trial>& trials, const Fans& fans, const Samples& all) const {
        parallel_for(trials.size(), 1, [&](size_t begin, size_t stop) {
            std::vector<uint32_t> drawn;
            for (size_t c = begin; c < stop && !told_to_stop(); ++c) {
                Trial& t = trials[c];
                t.order = fan_order(fans, t.candidate.cache, t.candidate.weights, t.rollouts);
                t.cost = 0;
                for (size_t s = 0; s < samples && !told_to_stop(); ++s) {
                    drawn.clear();
                    for (const uint32_t f : t.order) {
                        const uint32_t* corner = &all.at[s][size_t{f} * 3];
                        drawn.insert(drawn.end(), corner, corner + 3);
                    }
                    t.cost += static_cast<double>(count_transforms(model_, drawn, all.vertices)) / all.distinct[s];
                }
            }
        });
    }

    // The faces of an interval as one of its levels draws them in the same slots: every wedge gone by then is its
    // ancestor.
    std::vector<uint32_t> sample(const Interval& interval, size_t s) const {
        const auto level = interval.level + static_cast<uint32_t>((interval.end - interval.level) * s / (samples - 1));
        std::vector<uint32_t> drawn;
        drawn.reserve(interval.indices.size());
        for (const uint32_t w : interval.indices) drawn.push_back(input_.ancestor(w, level));
        return drawn;
    }

    // Gives the wedges of sample s numbers by their first use in any, so that what is drawn together lies together.
    // How many it uses.
    static double number_by_use(std::vector<uint32_t>& wedges, size_t s, Samples& all) {
        size_t count = 0;
        for (uint32_t& w : wedges) {
            uint32_t& number = all.number[w];
            if (number == none) {
                number = all.vertices++;
                all.used_by.push_back(none);
            }
            w = number;
            count += std::exchange(all.used_by[w], static_cast<uint32_t>(s)) != s ? 1 : 0;
        }
        return static_cast<double>(std::max<size_t>(count, 1));
    }

    const CacheModel model_;
    const double ratio_, seconds_;
    const std::atomic<bool>* const stop_;
    const std::vector<Candidate> candidates_;
    OrderInput input_;
    double look_ahead_below_ = 0;  // faces
    uint32_t sweeps_ = 0;
    bool careful_ = true, searched_less_ = false;
    std::vector<uint32_t> alive_at_;  // per level
    std::vector<Interval> coming_;    // whose faces are in order, the next one last
};

}  // namespace

std::unique_ptr<FaceOrderer> make_keyframe_orderer(const OrderOptions& options) {
    return std::make_unique<KeyframeOrderer>(options);
}

}  // namespace lodestone
