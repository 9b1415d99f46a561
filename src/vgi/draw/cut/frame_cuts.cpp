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

constexpr size_t first_at_once = 16,
                 most_at_once = 512;       // instances, after which it is looked whether they are too much
constexpr uint64_t much_words = 3 * 4096;  // of an instance that all threads are worth while for
constexpr size_t fewest_side_by_side = 8;  // instances: fewer may be large, and threads would be idle
constexpr uint64_t far_beyond = 4;         // times what there may be, where cutting ends

CutRequest request_for(const CutRegion& region, const CutInstance& instance, double raised, int64_t level) {
    CutRequest request;
    request.object_to_world = instance.there.object_to_world;
    request.views = region.views;
    request.level_view = region.level_view ? &*region.level_view : nullptr;
    request.pixel_error = region.budget.pixel_error * raised;
    // Level 0 is that of leaves, 1 that of the finest samples.
    request.forced_level = level < 0 ? -1 : std::max<int64_t>(level - 1, 0);
    request.forced_leaves = level == 0;
    request.cull_back_faces = region.views[0].culls_back_faces;
    request.margin = instance.margin;
    // What moved may turn while the cut is drawn, and the light's direction with it.
    request.casters_alone = region.find_moved(instance.number) == nullptr;
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
        if (cutter_ != nullptr && cutter_->moves_corners() && memory_.distant.empty()) {
            for (const AtlasSnapshot& a : input_.atlases)
                memory_.distant.emplace_back(a.atlas->topology->corners(), a.atlas->file->about());
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
    const AtlasSnapshot& atlas_of(const CutInstance& i) const {
        LODE_CHECK(i.there.asset < input_.atlases.size(), i.there.asset, input_.atlases.size());
        return input_.atlases[i.there.asset];
    }
    CutMemory::Demand& demand_of(const CutInstance& i) { return memory_.atlases[i.there.asset]; }
    CutRequest request_of(const CutInstance& i) const { return request_for(region_, i, result_.raised, result_.level); }
    // Charts that some view of the request sees and that may be drawn from samples.
    std::vector<uint32_t> charts_of(const CutInstance& i, const CutRequest& request) const {
        const OpenAtlas& atlas = *atlas_of(i).atlas;
        return atlas.charts.seen(Visibility(request, atlas.file->about()), atlas.file->about());
    }

    // The steps (DistantCuts) of instances that share cuts, for errors raised so much; nothing for all others.
    std::vector<std::optional<int32_t>> steps_of(std::span<const CutInstance> instances, const View& sets_levels) {
        std::vector<std::optional<int32_t>> steps(instances.size());
        if (memory_.distant.empty() || result_.level >= 0) return steps;
        const double magnification = magnification_of(sets_levels, region_.budget.pixel_error * result_.raised);
        for (DistantCuts& of_atlas : memory_.distant) of_atlas.begin(magnification);
        const InstanceDistance usual(sets_levels, region_.margin);
        parallel_for(instances.size(), 256, [&](size_t begin, size_t end) {
            for (size_t k = begin; k < end; ++k) {
                const CutInstance& i = instances[k];
                const PageBounds& around = atlas_of(i).atlas->topology->corners().bounds();
                const glm::mat4& to_world = i.there.object_to_world;
                const double nearest = i.margin == region_.margin
                                           ? usual.nearest(to_world, around)
                                           : InstanceDistance(sets_levels, i.margin).nearest(to_world, around);
                steps[k] = memory_.distant[i.there.asset].step_of(nearest);
            }
        });
        return steps;
    }
    const View& sets_levels() const { return region_.level_view ? *region_.level_view : region_.views[0]; }

    // Tells instances that share cuts from those that have their own, and forgets what is kept of all others.
    void tell_apart() {
        const auto steps = steps_of(input_.seen, sets_levels());
        shared_.clear();
        near_.clear();
        words_ = 0;
        for (size_t k = 0; k < steps.size(); ++k) {
            if (!steps[k]) {
                near_.push_back(k);
                continue;
            }
            const CutInstance& i = input_.seen[k];
            const auto [at, is_new] = shared_.try_emplace({i.there.asset, *steps[k]});
            if (is_new) {
                at->second.words = &memory_.distant[i.there.asset].triangles(*steps[k]);
                words_ += at->second.words->size();
            }
            at->second.instances[i.views].push_back(i.number);
            result_.triangles += (i.views & 1) != 0 ? at->second.words->size() / 3 : 0;
        }
        std::erase_if(memory_.instances, [&](const auto& kept) {
            const auto number = [&](size_t k) { return input_.seen[k].number; };
            return !std::ranges::binary_search(near_, kept.first, {}, number);
        });
        for (const size_t k : near_) memory_.instances.try_emplace(input_.seen[k].number);
    }

    // demand: of the instance's atlas. Results do not depend on what is in it before.
    Cut cut(const CutInstance& i, PageDemand& demand) {
        const CutRequest request = request_of(i);
        return cutter_->cut(atlas_of(i).pages->geometry, request, charts_of(i, request), demand,
                            memory_.instances.at(i.number));
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
            } else if (magnification_of(sets_levels(), budget.pixel_error * result_.raised) <= least_magnification) {
                result_.level = 1;
            } else {
                // Where it is far too much, not step by step: triangles fall at least as errors rise.
                const double steps = std::floor(std::log(beyond) / 2 / std::log(error_scale_step));
                result_.raised *= std::pow(error_scale_step, std::max(1.0, steps));
            }
        }
        result_.pixel_error = budget.pixel_error * result_.raised;
    }
    // How many times what there may be all instances are, about. Ends where they are too much already, unless all are
    // wanted.
    double cut_all(bool whole) {
        for (CutMemory::Demand& demand : memory_.atlases) demand.positions.clear();
        result_.triangles = 0;
        tell_apart();
        cuts_.assign(near_.size(), {});
        if (cutter_ == nullptr) return 0;
        const uint64_t far_too_much = whole ? limits_.worth : std::min(limits_.worth, far_beyond * limits_.most_words);
        const auto beyond_now = [&] {
            return std::max(share(words_, limits_.most_words), share(result_.triangles, region_.budget.max_triangles));
        };
        double beyond = beyond_now();
        size_t end = 0;
        for (size_t at_once = first_at_once; end < near_.size(); at_once = std::min(2 * at_once, most_at_once)) {
            const size_t begin = std::exchange(end, std::min(end + at_once, near_.size()));
            const bool all = cut_some(begin, end, far_too_much);
            result_.given_up = !all && far_too_much == limits_.worth;
            if (result_.given_up) return 0;
            // Where not all were cut, nobody knows how many triangles they have.
            beyond = !all ? static_cast<double>(far_beyond) : beyond_now();
            if (beyond > 1 && !whole) return beyond * static_cast<double>(near_.size()) / static_cast<double>(end);
        }
        return beyond;
    }
    // Those that were little are cut side by side, each by one thread; the others one after another, by all threads.
    // False where all words together come to more than `most`: then the last were not cut.
    bool cut_some(size_t begin, size_t end, uint64_t most) {
        std::vector<size_t> little, much;
        for (size_t i = begin; i < end; ++i) {
            const IncrementalCut& kept = memory_.instances.at(near(i).number);
            (kept.words < much_words ? little : much).push_back(i);
        }
        if (little.size() < fewest_side_by_side) {
            much.insert(much.end(), little.begin(), little.end());
            little.clear();
        }
        std::atomic<uint64_t> words = words_, triangles = result_.triangles;
        const auto cut_one = [&](size_t number, PageDemand& demand) {
            if (words > most) return;
            const CutInstance& i = near(number);
            cuts_[number] = cut(i, demand);
            uint64_t& its = memory_.instances.at(i.number).words;
            its = 0;
            for (const auto& part : cuts_[number].parts) its += part.second.size();
            words += its;
            triangles += cuts_[number].triangles;
        };
        std::mutex mutex;
        parallel_for(little.size(), 1 + little.size() / 128, [&](size_t first, size_t last) {
            CutMemory::Scratch found = take_scratch(mutex);
            for (size_t k = first; k < last; ++k) cut_one(little[k], found[near(little[k]).there.asset]);
            const std::lock_guard lock(mutex);
            memory_.scratch.push_back(std::move(found));
        });
        for (CutMemory::Scratch& found : memory_.scratch) {
            for (size_t a = 0; a < found.size(); ++a) {
                memory_.atlases[a].positions.add(found[a]);
                found[a].clear();
            }
        }
        for (const size_t number : much) cut_one(number, demand_of(near(number)).positions);
        words_ = words;
        result_.triangles = triangles;
        return words_ <= most;
    }
    // Room for what one thread finds, empty.
    CutMemory::Scratch take_scratch(std::mutex& mutex) {
        {
            const std::lock_guard lock(mutex);
            while (!memory_.scratch.empty()) {
                CutMemory::Scratch found = std::move(memory_.scratch.back());
                memory_.scratch.pop_back();
                const bool fits = std::ranges::equal(found, memory_.atlases, {}, &PageDemand::pages,
                                                     [](const auto& demand) { return demand.positions.pages(); });
                if (fits) return found;
            }
        }
        CutMemory::Scratch found;
        for (const CutMemory::Demand& demand : memory_.atlases) found.emplace_back(demand.positions.pages());
        return found;
    }
    static double share(uint64_t count, uint64_t most) {
        return static_cast<double>(count) / static_cast<double>(std::max<uint64_t>(most, 1));
    }

    // Which list draws which instances, without its words.
    struct Listed {
        const std::vector<uint32_t>* words;
        uint32_t cells;  // along a side of a page of positions
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
        for (const auto& [of, shared] : shared_) {
            if (shared.words->empty()) continue;
            lists.push_back({shared.words, cells(of.first), {}});
            for (const auto& [views, instances] : shared.instances) {
                lists.back().parts.push_back(part_of(instances, views));
                result_.instances_drawn += (views & 1) != 0 ? static_cast<uint32_t>(instances.size()) : 0;
            }
        }
        for (size_t k = 0; k < cuts_.size(); ++k) {
            if (cuts_[k].parts.empty()) continue;
            const FrameCuts::Part whole = part_of(std::span(&near(k).number, 1), 0);
            uint32_t views = 0;
            for (const auto& part : cuts_[k].parts) {
                lists.push_back({&part.second, cells(near(k).there.asset), {whole}});
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
        const std::vector<Listed> listed = all_lists();
        std::vector<TrianglesByKind> lists;
        std::vector<Chunk> chunks;
        for (const Listed& l : listed) {
            lists.emplace_back(*l.words, l.cells, cutter_->makes_triangles());
            for (size_t c = 0; c < lists.back().chunks(); ++c) chunks.push_back({lists.size() - 1, c});
        }
        const size_t grain = 1 + chunks.size() / 256;
        const auto for_chunks = [&](auto&& work) {
            parallel_for(chunks.size(), grain, [&](size_t begin, size_t end) {
                for (size_t c = begin; c < end; ++c) work(chunks[c]);
            });
        };
        for_chunks([&](const Chunk& c) { lists[c.list].look_at(c.chunk); });
        std::vector<size_t> first;
        size_t next = 0;
        for (size_t l = 0; l < lists.size(); ++l) {
            first.push_back(next);
            for (const auto& run : lists[l].runs()) {
                for (FrameCuts::Part part : listed[l].parts) {
                    part.kinds = run.kinds;
                    part.first_word = static_cast<uint32_t>(next);
                    part.words = run.words;
                    result_.parts.push_back(part);
                }
                next += run.words;
            }
        }
        const auto words = std::make_shared_for_overwrite<uint32_t[]>(next);
        for_chunks([&](const Chunk& c) { lists[c.list].copy(c.chunk, words.get() + first[c.list]); });
        result_.words = words;
        result_.word_count = next;
    }

    void look_for_attributes() {
        for (CutMemory::Demand& demand : memory_.atlases) demand.attributes.clear();
        for (const size_t k : near_) {
            const CutInstance& i = input_.seen[k];
            CutRequest request = request_of(i);
            request.views = request.views.subspan(0, 1);
            atlas_of(i).pages->attributes.want(atlas_of(i).atlas->file->about(), atlas_of(i).atlas->spacing, request,
                                               charts_of(i, request), demand_of(i).attributes);
        }
    }

    void look_ahead() {
        for (CutMemory::Demand& demand : memory_.atlases) demand.prefetched.clear();
        if (!input_.ahead || result_.level >= 0) return;
        const auto steps = steps_of(input_.seen_ahead, *input_.ahead);
        for (size_t k = 0; k < steps.size(); ++k) {
            if (steps[k]) continue;
            const CutInstance& i = input_.seen_ahead[k];
            CutRequest request = request_of(i);
            request.views = std::span(&*input_.ahead, 1);
            prefetch(atlas_of(i).pages->geometry, request, charts_of(i, request), demand_of(i).positions,
                     demand_of(i).prefetched);
        }
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
    const CutInstance& near(size_t k) const { return input_.seen[near_[k]]; }

    FrameCuts result_;
    struct Shared {
        const std::vector<uint32_t>* words = nullptr;         // a list of DistantCuts
        std::map<uint32_t, std::vector<uint32_t>> instances;  // numbers, rising, by the views that may see them
    };
    std::map<std::pair<uint32_t, int32_t>, Shared> shared_;  // by asset and step
    std::vector<size_t> near_;                               // of CutInput::seen, all others
    std::vector<Cut> cuts_;                                  // of near_
    uint64_t words_ = 0;                                     // of all
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
