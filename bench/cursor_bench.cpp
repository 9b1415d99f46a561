// What a step of the cursor costs per order: the walk from full detail to the base by ecols, and back by vsplits;
// items are steps.
#include <benchmark/benchmark.h>

#include "base/check.h"
#include "bench/rivals.h"
#include "lod/bake.h"
#include "lod/cursor.h"

namespace lodestone {
namespace {

const std::vector<std::string> orders = {"classic", "static", "keyframe"};

void register_subject(const Subject& subject) {
    static std::vector<std::unique_ptr<ProgressiveMesh>> baked;
    const auto list = make_quadric_simplifier()->simplify(subject.mesh, {});
    LODE_CHECK(list.has_value());
    auto made = bake_progressive_mesh(subject.mesh, *list, orders);
    LODE_CHECK(made.has_value(), made.error().message);
    baked.push_back(std::make_unique<ProgressiveMesh>(std::move(*made)));
    const ProgressiveMesh& pm = *baked.back();
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
