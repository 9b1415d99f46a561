// What building an order costs, and what a step of the cursor costs per order: the walk from full detail to the base by
// ecols, and back by vsplits; items are steps. worst_step is the slowest single step in units of the mean step of its
// interval between keyframes, each step's time being the least of many walks; jump is a goto between the ends, by
// snapshots, in units of copying the index buffer that is drawn there.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>

#include "base/check.h"
#include "bench/rivals.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"

namespace lodestone {
namespace {

const std::vector<std::string> orders = {"classic", "static", "greedy", "keyframe"};

// Of the steps of one walk, each the least of several.
double worst_step(const ProgressiveMesh& pm, uint32_t order, bool down) {
    using Clock = std::chrono::steady_clock;
    const uint32_t last = pm.levels() - 1;
    std::vector<double> least(last, 1e9);  // of the step between level i and i + 1
    PmCursor cursor(pm, order);
    for (int walk = 0; walk < 40; ++walk) {
        cursor.goto_level(down ? 0 : last);
        for (uint32_t n = 0; n < last; ++n) {
            const auto begin = Clock::now();
            down ? cursor.ecol() : cursor.vsplit();
            const double ns = std::chrono::duration<double, std::nano>(Clock::now() - begin).count();
            double& step = least[down ? n : last - 1 - n];
            step = std::min(step, ns);
        }
    }
    double worst = 0;
    const auto& keyframes = pm.orders[order].keyframes;
    for (size_t k = 0; k <= keyframes.size(); ++k) {
        const size_t begin = k == 0 ? 0 : keyframes[k - 1].level;
        const size_t end = k == keyframes.size() ? last : keyframes[k].level;
        double sum = 0, most = 0;
        for (size_t i = begin; i < end; ++i) {
            sum += least[i];
            most = std::max(most, least[i]);
        }
        if (end > begin) worst = std::max(worst, most / (sum / static_cast<double>(end - begin)));
    }
    return worst;
}

// A goto to `level` from the other end against copying what is drawn there.
double jump_against_copy(const ProgressiveMesh& pm, uint32_t order, uint32_t level) {
    using Clock = std::chrono::steady_clock;
    PmCursor cursor(pm, order);
    cursor.use(std::make_shared<PmSnapshots>(pm, order));
    const uint32_t last = pm.levels() - 1, start = level < last / 2 ? last : 0;
    double jump = 1e18, copy = 1e18;
    std::vector<uint32_t> into;
    for (int n = 0; n < 40; ++n) {
        cursor.goto_level(start);
        auto begin = Clock::now();
        cursor.goto_level(level);
        jump = std::min(jump, std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
        into.resize(cursor.drawn_indices().size());
        begin = Clock::now();
        std::ranges::copy(cursor.drawn_indices(), into.begin());
        benchmark::DoNotOptimize(into.data());
        copy = std::min(copy, std::chrono::duration<double, std::nano>(Clock::now() - begin).count());
    }
    return jump / copy;
}

void register_subject(const Subject& subject) {
    static std::vector<std::unique_ptr<ProgressiveMesh>> baked;
    const auto list = make_quadric_simplifier()->simplify(subject.mesh, {});
    LODE_CHECK(list.has_value());
    auto made = bake_progressive_mesh(subject.mesh, *list, orders);
    LODE_CHECK(made.has_value(), made.error().message);
    baked.push_back(std::make_unique<ProgressiveMesh>(std::move(*made)));
    const ProgressiveMesh& pm = *baked.back();
    // Building an order, wall clock; items are triangles.
    const auto kept = std::make_shared<const CollapseList>(*list);
    for (const std::string& order : orders) {
        benchmark::RegisterBenchmark(
            ("build/" + order + "/" + subject.name).c_str(),
            [&subject, kept, order](benchmark::State& state) {
                for (auto _ : state) {
                    auto built = bake_progressive_mesh(subject.mesh, *kept, {order});
                    LODE_CHECK(built.has_value());
                }
                state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(subject.mesh.triangle_count()));
            })
            ->Unit(benchmark::kSecond)
            ->UseRealTime();
    }
    for (uint32_t order = 0; order < orders.size(); ++order) {
        const auto add = [&](const char* what, bool down) {
            benchmark::RegisterBenchmark((std::string(what) + "/" + orders[order] + "/" + subject.name).c_str(),
                                         [&pm, order, down](benchmark::State& state) {
                                             PmCursor cursor(pm, order);
                                             const uint32_t last = pm.levels() - 1;
                                             for (auto _ : state) {
                                                 state.PauseTiming();
                                                 cursor.goto_level(down ? 0 : last);
                                                 state.ResumeTiming();
                                                 cursor.goto_level(down ? last : 0);
                                             }
                                             state.SetItemsProcessed(state.iterations() * last);
                                             state.counters["worst_step"] = worst_step(pm, order, down);
                                             const PmSnapshots snapshots(pm, order);
                                             const auto* middle = snapshots.nearest(down ? last / 2 : 0);
                                             if (middle != nullptr)
                                                 state.counters["jump"] = jump_against_copy(pm, order, middle->level);
                                         })
                ->Unit(benchmark::kMillisecond);
        };
        add("ecol", true);
        add("vsplit", false);
    }
}

}  // namespace
}  // namespace lodestone

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    static const std::vector<lodestone::Subject> subjects = lodestone::simplification_subjects();
    for (const auto& subject : subjects) {
        if (subject.name == "igea.ply" || subject.name == "stanford-bunny.obj" || subjects.size() == 1)
            lodestone::register_subject(subject);
    }
    benchmark::RunSpecifiedBenchmarks();
}
