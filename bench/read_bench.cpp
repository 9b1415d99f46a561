// CPU time of reading a binary PLY of three million triangles.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "base/check.h"
#include "base/clock.h"
#include "mesh/generate.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"

namespace lodestone {
namespace {

void read_ply(benchmark::State& state, Shape shape) {
    const auto path = std::filesystem::temp_directory_path() / "lodestone_read_bench.ply";
    {
        const TriMesh mesh = generate(shape, 3000000, 1);
        LODE_CHECK(write_mesh(mesh, path).has_value());
    }
    size_t triangles = 0;
    for (auto _ : state) {
        const Stopwatch watch;
        auto mesh = read_mesh(path);
        state.SetIterationTime(watch.cpu());
        LODE_CHECK(mesh.has_value());
        triangles = mesh->triangle_count();
    }
    state.counters["triangles"] = static_cast<double>(triangles);
    std::filesystem::remove(path);
}
BENCHMARK_CAPTURE(read_ply, rock, Shape::rock)->UseManualTime()->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK_CAPTURE(read_ply, terrain, Shape::terrain)->UseManualTime()->Unit(benchmark::kMillisecond)->Iterations(5);

}  // namespace
}  // namespace lodestone

BENCHMARK_MAIN();
