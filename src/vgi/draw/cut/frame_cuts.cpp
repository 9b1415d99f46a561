#include "vgi/draw/cut/frame_cuts.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>

#include "base/check.h"
#include "base/threads.h"
#include "vgi/asset/saturation.h"
#include "vgi/draw/cut/prefetch.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/vertex_kinds.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

namespace {

constexpr size_t first_at_once = 64,
                 most_at_once = 512;       // cuts, after which it is looked whether they are too much
constexpr uint64_t much_words = 3 * 4096;  // of a cut that all threads are worth while for
constexpr size_t fewest_side_by_side = 8;  // cuts: fewer may be large, and threads would be idle
constexpr uint64_t far_beyond = 4;         // times what there may be, where cutting ends

CutRequest request_for(const CutRegion& region, const CutInstance& instance, double raised, int64_t level) {
    CutRequest request;
    request.object_to_world = region.there(instance).object_to_world;
    request.views = region.views;
    request.level_view = region.level_view ? &*region.level_view : nullptr;
    request.pixel_error = region.budget.pixel_error * raised;
    // Level 0 is that of leaves, 1 that of the finest samples.
    request.forced_level = level < 0 ? -1 : std::max<int64_t>(level - 1, 0);
    request.forced_leaves = level == 0;
    request.cull_back_faces = region.views[0].culls_back_faces;
    request.margin = region.margin_of(instance);
    // What moved may turn while the cut is drawn, and the light's direction with it.
    request.casters_alone = instance.moved == nullptr;
    return request;
}

// The cuts of one region, step by step.
class CutMaker {
public:
    CutMaker(const Cutter* cutter, const CutInput& input, const CutLimits& limits, CutMemory& memory)
        : cutter_(cutter), input_(input), region_(input.region), limits_(limits), memory_(memory) {
        memory_.atlases.resize(input_.atlases.size());
        for (size_t a = 0; a < input_.atlases.size(); ++a) {
            CutMemory::Demand& demand = memory_.atlases[a];
            const AtlasPages& pages = *input_.atlases[a].pages;
            if (demand.positions.pages() == pages.geometry.units()) continue;
            demand = {PageDemand(pages.geometry.units()), PageDemand(pages.geometry.units()),
                      PageDemand(pages.attributes.pages())};
        }
        if (cutter_ != nullptr && cutter_->moves_corners() && memory_.shared.empty()) {
            for (const AtlasSnapshot& a : input_.atlases) memory_.shared.emplace_back(*a.atlas);
        }
    }

    FrameCuts run() {
        fit();
        if (result_.given_up) return std::move(result_);
        put_together();
        look_for_attributes();
        look_ahead();
        collect_pages();
        result_.region = region_;
        return std::move(result_);
    }

private:
    // A cut to make: of an instance, or one that instances share.
    struct Job {
        uint32_t asset;
        const CutInstance* instance;  // null: shared
        size_t shared;                // into shared_
        SharedCuts::Step step;
    };
    // Instances that are drawn with one list.
    struct Shared {
        uint32_t asset = 0;
        SharedCut* cut = nullptr;                             // null: of corners
        const std::vector<uint32_t>* words = nullptr;         // once it is made
        std::map<uint32_t, std::vector<uint32_t>> instances;  // numbers, rising, by the views that may see them
        std::vector<TrianglesByKind::Run> runs() const {
            return cut != nullptr ? cut->runs()
                                  : std::vector<TrianglesByKind::Run>{
                                        {LODE_VGI_KIND_CORNERS, static_cast<uint32_t>(words->size())}};
        }
        // By views[0].
        uint64_t seen_instances() const {
            uint64_t seen = 0;
            for (const auto& [views, numbers] : instances) seen += (views & 1) != 0 ? numbers.size() : 0;
            return seen;
        }
        uint64_t seen_triangles() const { return seen_instances() * words->size() / 3; }
    };

    uint32_t asset_of(const CutInstance& i) const {
        const uint32_t asset = region_.there(i).asset;
        LODE_CHECK(asset < input_.atlases.size(), asset, input_.atlases.size());
        return asset;
    }
    const AtlasSnapshot& atlas_of(const CutInstance& i) const { return input_.atlases[asset_of(i)]; }
    CutRequest request_of(const CutInstance& i) const { return request_for(region_, i, result_.raised, result_.level); }
    // Charts that some view of the request sees.
    std::vector<uint32_t> charts_of(uint32_t asset, const CutRequest& request) const {
        const OpenAtlas& atlas = *input_.atlases[asset].atlas;
        return atlas.charts.seen(Visibility(request, atlas.file->about()), atlas.file->about());
    }

    const View& sets_levels() const { return region_.level_view ? *region_.level_view : region_.views[0]; }
    double pixel_error() const { return region_.budget.pixel_error * result_.raised; }

    // Work at each of `count`, side by side. work(k, found): found takes pages of an atlas, asset_of(k), and then goes
    // to what is known of that.
    template <class AssetOf, class Work>
    void find_pages(size_t count, PageDemand CutMemory::Demand::*kind, AssetOf&& asset_of, Work&& work) {
        parallel_for(count, 1 + count / 128, [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) {
                PageDemand& all = memory_.atlases[asset_of(k)].*kind;
                PageDemand found = take_scratch(all.pages());
                work(k, found);
                const std::lock_guard lock(mutex_);
                all.add(found);
                found.clear();
                memory_.scratch[found.pages()].push_back(std::move(found));
            }
        });
    }
    PageDemand take_scratch(uint32_t pages) {
        {
            const std::lock_guard lock(mutex_);
            std::vector<PageDemand>& free = memory_.scratch[pages];
            if (!free.empty()) {
                PageDemand found = std::move(free.back());
                free.pop_back();
                return found;
            }
        }
        return PageDemand(pages);
    }

    // Instances of an atlas that share cuts, by their step; and those that have their own.
    struct Apart {
        std::map<std::pair<uint32_t, SharedCuts::Step>, std::vector<size_t>> shared;  // into the instances, rising
        std::vector<size_t> own;                                                      // rising
    };
    Apart tell_apart(std::span<const CutInstance> instances, const View& sets_levels) {
        const std::vector<std::optional<SharedCuts::Step>> steps = steps_of(instances, sets_levels);
        Apart apart;
        for (size_t k = 0; k < steps.size(); ++k) {
            if (steps[k]) {
                apart.shared[{asset_of(instances[k]), *steps[k]}].push_back(k);
            } else {
                apart.own.push_back(k);
            }
        }
        std::erase_if(apart.shared, [&](const auto& group) {
            const bool too_few = group.first.second.of_samples && group.second.size() < SharedCuts::fewest;
            if (too_few) apart.own.insert(apart.own.end(), group.second.begin(), group.second.end());
            return too_few;
        });
        std::ranges::sort(apart.own);
        return apart;
    }
    // For errors raised so much; nothing for instances that have cuts of their own in any case.
    std::vector<std::optional<SharedCuts::Step>> steps_of(std::span<const CutInstance> instances,
                                                          const View& sets_levels) {
        std::vector<std::optional<SharedCuts::Step>> steps(instances.size());
        if (memory_.shared.empty() || result_.level >= 0) return steps;
        const double magnification = magnification_of(sets_levels, pixel_error());
        for (SharedCuts& of_atlas : memory_.shared) of_atlas.begin(magnification);
        const InstanceDistance usual(sets_levels, region_.margin);
        parallel_for(instances.size(), 256, [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) {
                const CutInstance& i = instances[k];
                const Sphere around = atlas_of(i).atlas->charts.sphere();
                const glm::mat4& to_world = region_.there(i).object_to_world;
                const double nearest = i.moved == nullptr
                                           ? usual.nearest(to_world, around)
                                           : InstanceDistance(sets_levels, i.moved->margin).nearest(to_world, around);
                steps[k] = memory_.shared[asset_of(i)].step_of(nearest);
            }
        });
        return steps;
    }

    // Sets what is to be cut and drawn, and forgets what is kept of all else.
    void set_jobs() {
        shared_.clear();
        jobs_.clear();
        words_ = 0;
        const Apart apart = tell_apart(input_.seen, sets_levels());
        std::vector<std::vector<int32_t>> with_samples(input_.atlases.size());
        for (const auto& [of, instances] : apart.shared) {
            const auto& [asset, step] = of;
            Shared& shared = shared_.emplace_back();
            shared.asset = asset;
            for (const size_t k : instances) shared.instances[input_.seen[k].views].push_back(input_.seen[k].number);
            if (step.of_samples) {
                with_samples[asset].push_back(step.number);
                shared.cut = &memory_.shared[asset].of_samples(step.number);
                jobs_.push_back({asset, nullptr, shared_.size() - 1, step});
            } else {
                shared.words = &memory_.shared[asset].of_corners(step.number);
                words_ += shared.words->size();
                result_.triangles += shared.seen_triangles();
            }
        }
        for (size_t a = 0; a < memory_.shared.size(); ++a) memory_.shared[a].keep(with_samples[a]);
        std::erase_if(memory_.instances, [&](const auto& kept) {
            const auto number = [&](size_t k) { return input_.seen[k].number; };
            return !std::ranges::binary_search(apart.own, kept.first, {}, number);
        });
        for (const size_t k : apart.own) {
            const CutInstance& i = input_.seen[k];
            memory_.instances.try_emplace(i.number);
            jobs_.push_back({asset_of(i), &i, 0, {}});
        }
        cuts_.assign(jobs_.size(), {});
    }

    // Cuts all instances, with larger errors where there is too much: all rise alike, and where they may not rise
    // further one level is drawn everywhere.
    void fit() {
        const Budget& budget = region_.budget;
        uint32_t levels = 1;
        for (const AtlasSnapshot& a : input_.atlases) levels = std::max(levels, 1 + a.atlas->file->about().levels());
        // From what the last cuts needed: views change little.
        result_.raised = limits_.raised;
        if (may_lower(limits_.triangles, budget.max_triangles) && may_lower(limits_.words, limits_.most_words))
            result_.raised = std::max(1.0, result_.raised / error_scale_step);
        result_.level = budget.forced_level;
        for (;;) {
            const double beyond = cut_all(result_.level >= levels - 1);
            if (beyond <= 1 || result_.given_up) break;
            if (result_.level >= 0) {
                if (result_.level >= levels - 1) break;
                ++result_.level;
            } else if (magnification_of(sets_levels(), pixel_error()) <= least_magnification) {
                result_.level = 1;
            } else {
                // Where it is far too much, not step by step: triangles fall at least as errors rise.
                const double steps = std::floor(std::log(beyond) / 2 / std::log(error_scale_step));
                result_.raised *= std::pow(error_scale_step, std::max(1.0, steps));
            }
        }
        result_.pixel_error = pixel_error();
    }
    // How many times what there may be all instances are, about. Ends where they are too much already, unless all are
    // wanted.
    double cut_all(bool whole) {
        for (CutMemory::Demand& demand : memory_.atlases) demand.positions.clear();
        result_.triangles = 0;
        set_jobs();
        if (cutter_ == nullptr) return 0;
        const uint64_t far_too_much = whole ? limits_.worth : std::min(limits_.worth, far_beyond * limits_.most_words);
        // all: of instances' own cuts, how many times as many as have been made.
        const auto beyond_with = [&](double all) {
            uint64_t words = 0, triangles = 0;
            for (const Shared& drawn : shared_) {
                if (drawn.words == nullptr) continue;
                words += drawn.words->size();
                triangles += drawn.seen_triangles();
            }
            const auto so_many = [&](uint64_t of_shared, uint64_t together) {
                return static_cast<double>(of_shared) + all * static_cast<double>(together - of_shared);
            };
            return std::max(share(so_many(words, words_), limits_.most_words),
                            share(so_many(triangles, result_.triangles), region_.budget.max_triangles));
        };
        double beyond = beyond_with(1);
        const auto shared = static_cast<size_t>(std::ranges::count(jobs_, nullptr, &Job::instance));  // they come first
        size_t end = 0;
        for (size_t at_once = first_at_once; end < jobs_.size(); at_once = std::min(2 * at_once, most_at_once)) {
            const size_t begin = std::exchange(end, std::min(end + at_once, jobs_.size()));
            const bool all = cut_some(begin, end, far_too_much);
            result_.given_up = !all && far_too_much == limits_.worth;
            if (result_.given_up) return 0;
            // Where not all were cut, nobody knows how many triangles they have.
            beyond = !all ? static_cast<double>(far_beyond) : beyond_with(1);
            const double times =
                end > shared ? static_cast<double>(jobs_.size() - shared) / static_cast<double>(end - shared) : 1;
            if (beyond > 1 && !whole) return all ? beyond_with(times) : beyond * times;
        }
        return beyond;
    }
    // Those that were little, or no more than a thread's share, are cut side by side, each by one thread; the others
    // one after another, by all threads.
    // False where all words together come to more than `most`: then the last were not cut.
    bool cut_some(size_t begin, size_t end, uint64_t most) {
        std::vector<size_t> little, much;
        uint64_t together = 0;
        for (size_t j = begin; j < end; ++j) together += words_to_make(jobs_[j]);
        for (size_t j = begin; j < end; ++j) {
            const uint64_t its = words_to_make(jobs_[j]);
            (its < much_words || its * thread_count() <= together ? little : much).push_back(j);
        }
        if (little.size() < fewest_side_by_side) {
            much.insert(much.end(), little.begin(), little.end());
            little.clear();
        }
        std::atomic<uint64_t> words = words_, triangles = result_.triangles;
        const auto cut_one = [&](size_t j, PageDemand& found) {
            if (words > most) return;
            const CutAlone made = cut(j, found);
            words += made.words;
            triangles += made.triangles;
        };
        const auto cut_those = [&](std::span<const size_t> which) {
            find_pages(
                which.size(), &CutMemory::Demand::positions, [&](size_t k) { return jobs_[which[k]].asset; },
                [&](size_t k, PageDemand& found) { cut_one(which[k], found); });
        };
        cut_those(little);
        for (const size_t& j : much) cut_those(std::span(&j, 1));
        words_ = words;
        result_.triangles = triangles;
        return words_ <= most;
    }
    bool is_good(const Job& job) const {
        return shared_[job.shared].cut->is_good(input_.atlases[job.asset].pages->geometry,
                                                memory_.shared[job.asset].magnification());
    }
    // As many as there were in the cut before.
    uint64_t words_to_make(const Job& job) const {
        if (job.instance != nullptr) return memory_.instances.at(job.instance->number).words;
        return is_good(job) ? 0 : shared_[job.shared].cut->words().size();
    }
    struct CutAlone {
        uint64_t words, triangles;
    };
    // found: empty. Results do not depend on what else is cut.
    CutAlone cut(size_t j, PageDemand& found) {
        const Job& job = jobs_[j];
        const AtlasPages& pages = *input_.atlases[job.asset].pages;
        if (job.instance == nullptr) {
            Shared& shared = shared_[job.shared];
            const SharedCuts& of_atlas = memory_.shared[job.asset];
            if (!is_good(job)) {
                shared.cut->make(*cutter_, pages.geometry, of_atlas.request_for(job.step, sets_levels(), pixel_error()),
                                 of_atlas.magnification(), found);
                found.clear();
            }
            shared.cut->add_to(found, shared.seen_instances() > 0);
            shared.words = &shared.cut->words();
            return {shared.words->size(), shared.seen_triangles()};
        }
        const CutInstance& i = *job.instance;
        const CutRequest request = request_of(i);
        IncrementalCut& kept = memory_.instances.at(i.number);
        cuts_[j] = cutter_->cut(pages.geometry, request, charts_of(job.asset, request), found, kept);
        kept.words = 0;
        for (const auto& part : cuts_[j].parts) kept.words += part.second.size();
        return {kept.words, cuts_[j].triangles};
    }
    static double share(double count, uint64_t most) {
        return count / static_cast<double>(std::max<uint64_t>(most, 1));
    }

    // Which list draws which instances, without its words.
    struct Listed {
        TrianglesByKind by_kind;
        std::vector<FrameCuts::Part> parts;
    };
    // Adds the instances to the result, as a part of these views.
    FrameCuts::Part part_of(std::span<const uint32_t> instances, uint32_t views) {
        const auto first = static_cast<uint32_t>(result_.instances.size());
        result_.instances.insert(result_.instances.end(), instances.begin(), instances.end());
        return {first, static_cast<uint32_t>(instances.size()), views, 0, 0, 0};
    }
    std::vector<Listed> all_lists() {
        std::vector<Listed> lists;
        const auto cells = [&](uint32_t asset) {
            return input_.atlases[asset].pages->geometry.tree().cells_per_page();
        };
        for (const Shared& shared : shared_) {
            if (shared.words->empty()) continue;
            lists.push_back({{*shared.words, shared.runs()}, {}});
            for (const auto& [views, instances] : shared.instances) {
                lists.back().parts.push_back(part_of(instances, views));
                result_.instances_drawn += (views & 1) != 0 ? static_cast<uint32_t>(instances.size()) : 0;
            }
        }
        for (size_t k = 0; k < cuts_.size(); ++k) {
            if (cuts_[k].parts.empty()) continue;
            const FrameCuts::Part whole = part_of(std::span(&jobs_[k].instance->number, 1), 0);
            uint32_t views = 0;
            for (const auto& part : cuts_[k].parts) {
                lists.push_back({{part.second, cells(jobs_[k].asset), cutter_->makes_triangles()}, {whole}});
                lists.back().parts[0].views = part.first;
                views |= part.first;
            }
            result_.instances_drawn += views & 1;
        }
        return lists;
    }

    // All lists one after another. They are megabytes: copied by all threads, which also are the first to touch them.
    void put_together() {
        struct Chunk {
            size_t list, chunk;
        };
        std::vector<Listed> lists = all_lists();
        std::vector<Chunk> chunks;
        for (size_t l = 0; l < lists.size(); ++l) {
            for (size_t c = 0; c < lists[l].by_kind.chunks(); ++c) chunks.push_back({l, c});
        }
        const size_t grain = 1 + chunks.size() / 256;
        const auto for_chunks = [&](auto&& work) {
            parallel_for(chunks.size(), grain, [&](size_t begin, size_t end) {
                for (size_t c = begin; c < end; ++c) work(chunks[c]);
            });
        };
        for_chunks([&](const Chunk& c) { lists[c.list].by_kind.look_at(c.chunk); });
        std::vector<size_t> first;
        size_t next = 0;
        for (size_t l = 0; l < lists.size(); ++l) {
            first.push_back(next);
            for (const auto& run : lists[l].by_kind.runs()) {
                for (FrameCuts::Part part : lists[l].parts) {
                    part.kinds = run.kinds;
                    part.first_word = static_cast<uint32_t>(next);
                    part.words = run.words;
                    result_.parts.push_back(part);
                }
                next += run.words;
            }
        }
        const auto words = std::make_shared_for_overwrite<uint32_t[]>(next);
        for_chunks([&](const Chunk& c) { lists[c.list].by_kind.copy(c.chunk, words.get() + first[c.list]); });
        result_.words = words;
        result_.word_count = next;
    }

    void look_for_attributes() {
        for (CutMemory::Demand& demand : memory_.atlases) demand.attributes.clear();
        find_pages(
            jobs_.size(), &CutMemory::Demand::attributes, [&](size_t j) { return jobs_[j].asset; },
            [&](size_t j, PageDemand& found) {
                const Job& job = jobs_[j];
                if (job.instance == nullptr && shared_[job.shared].seen_instances() == 0) return;
                const AtlasSnapshot& atlas = input_.atlases[job.asset];
                CutRequest request = job.instance != nullptr ? request_of(*job.instance)
                                                             : memory_.shared[job.asset].request_for(
                                                                   job.step, sets_levels(), pixel_error());
                request.views = request.views.subspan(0, 1);
                atlas.pages->attributes.want(atlas.atlas->file->about(), atlas.atlas->spacing, request,
                                             charts_of(job.asset, request), found);
            });
    }

    void look_ahead() {
        for (CutMemory::Demand& demand : memory_.atlases) demand.prefetched.clear();
        if (!input_.ahead || result_.level >= 0) return;
        const Apart apart = tell_apart(input_.seen_ahead, *input_.ahead);
        std::vector<std::pair<uint32_t, CutRequest>> requests;  // by asset
        for (const auto& [of, instances] : apart.shared) {
            const auto& [asset, step] = of;
            if (step.of_samples)
                requests.emplace_back(asset, memory_.shared[asset].request_for(step, *input_.ahead, pixel_error()));
        }
        for (const size_t k : apart.own) {
            const CutInstance& i = input_.seen_ahead[k];
            requests.emplace_back(asset_of(i), request_of(i));
            requests.back().second.views = std::span(&*input_.ahead, 1);
        }
        find_pages(
            requests.size(), &CutMemory::Demand::prefetched, [&](size_t k) { return requests[k].first; },
            [&](size_t k, PageDemand& found) {
                const auto& [asset, request] = requests[k];
                prefetch(input_.atlases[asset].pages->geometry, request, charts_of(asset, request),
                         memory_.atlases[asset].positions, found);
            });
    }

    void collect_pages() {
        for (uint32_t a = 0; a < input_.atlases.size(); ++a) {
            const CutMemory::Demand& found = memory_.atlases[a];
            collect(Layer::geometry, a, found.positions);
            collect(Layer::attributes, a, found.attributes);
            for (const uint32_t unit : found.prefetched.all_asked())
                wish(found.prefetched.wish(unit), Layer::geometry, true, a, unit);
        }
        sort_wishes(result_.wishes);
    }
    void collect(Layer layer, uint32_t a, const PageDemand& found) {
        // Pages have higher numbers than their parents.
        for (const uint32_t unit : found.all_touched()) {
            const auto [of, number] = named(layer, a, unit);
            result_.touched[index_of(of)].push_back(input_.atlases[a].atlas->first[index_of(of)] + number);
        }
        for (const uint32_t unit : found.all_asked()) wish(found.wish(unit), layer, false, a, unit);
    }
    // Beyond pages of positions are parts of leaves (Residency::units).
    std::pair<Layer, uint32_t> named(Layer layer, uint32_t a, uint32_t unit) const {
        const uint32_t pages = input_.atlases[a].pages->geometry.pages();
        if (layer != Layer::geometry || unit < pages) return {layer, unit};
        return {Layer::leaves, unit - pages};
    }
    void wish(float wanted, Layer layer, bool prefetched, uint32_t a, uint32_t unit) {
        const auto [of, number] = named(layer, a, unit);
        result_.wishes.push_back({wanted, of, prefetched, a, number});
    }

    const Cutter* const cutter_;
    const CutInput& input_;
    const CutRegion& region_;
    const CutLimits& limits_;
    CutMemory& memory_;

    FrameCuts result_;

    std::vector<Shared> shared_;
    std::vector<Job> jobs_;
    std::vector<Cut> cuts_;  // of jobs_ for an instance
    std::mutex mutex_;       // of memory_.scratch, and what pages are found
    uint64_t words_ = 0;     // of all
};

}  // namespace

FrameCuts make_cuts(const Cutter* cutter, const CutInput& input, const CutLimits& limits, CutMemory& memory) {
    return CutMaker(cutter, input, limits, memory).run();
}

void sort_wishes(std::vector<FrameCuts::Wish>& wishes) {
    std::ranges::sort(wishes, [](const FrameCuts::Wish& x, const FrameCuts::Wish& y) {
        return x.wanted != y.wanted ? x.wanted > y.wanted
                                    : std::tuple(x.layer, x.atlas, x.number) < std::tuple(y.layer, y.atlas, y.number);
    });
}

}  // namespace lodestone::vgi
