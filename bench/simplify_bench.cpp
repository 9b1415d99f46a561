// CPU time of collapse lists: ours to the end, OpenMesh's ModQuadric decimater and meshoptimizer to 1%.
#include <benchmark/benchmark.h>

#include "base/clock.h"
#include "bench/rivals.h"
#include "lod/bake/simplify/simplifier.h"

namespace lodestone {
namespace {

void register_subject(const Subject& subject) {
    const auto add = [&](const char* who, auto run) {
        benchmark::RegisterBenchmark((std::string(who) + "/" + subject.name).c_str(),
                                     [&subject, run](benchmark::State& state) {
                                         double total = 0;
                                         for (auto _ : state) {
                                             const double cpu = run(subject.mesh);
                                             state.SetIterationTime(cpu);
                                             total += cpu;
                                         }
                                         state.counters["s_per_100k"] =
                                             total / static_cast<double>(state.iterations()) * 1e5 /
                                             static_cast<double>(subject.mesh.triangle_count());
                                     })
            ->UseManualTime()
            ->Unit(benchmark::kMillisecond);
    };
    add("lodestone", [](const TriMesh& mesh) {
        const Stopwatch watch;
        auto list = make_quadric_simplifier()->simplify(mesh, {});
        benchmark::DoNotOptimize(list);
        return watch.cpu();
    });
    add("openmesh", [](const TriMesh& mesh) {
        double cpu = 0;
        openmesh_decimated(mesh, mesh.triangle_count() / 100, &cpu);
        return cpu;
    });
    add("meshoptimizer", [](const TriMesh& mesh) {
        double cpu = 0;
        meshoptimizer_simplified(mesh, mesh.triangle_count() / 100, &cpu);
        return cpu;
    });
}

}  // namespace
}  // namespace lodestone

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    static const std::vector<lodestone::Subject> subjects = lodestone::simplification_subjects();
    for (const auto& subject : subjects) lodestone::register_subject(subject);
    benchmark::RunSpecifiedBenchmarks();
}
