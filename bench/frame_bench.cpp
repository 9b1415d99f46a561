// Frames of the demonstration's rock along its flight, by every backend and face order, at a pixel error of 1: time per
// frame, and as counters frames per second, triangles, and ACMR as the device counted it and as a FIFO of 16 would.
#include <benchmark/benchmark.h>

#include <cstdio>

#include "apps/drawing/flight.h"
#include "apps/terminal.h"
#include "base/check.h"

namespace lodestone {
namespace {

constexpr uint32_t width = 1280, height = 720, frames_of_flight = 24;

// Renderer and scene stay for the whole run.
struct Workbench {
    std::unique_ptr<Renderer> renderer;
    ReadyScene scene;
};
Result<Workbench> make_workbench() {
    auto scene = read_scene(LODESTONE_SOURCE_DIR "/assets/rock.scene.json");
    if (!scene) return tl::unexpected(scene.error());
    auto ready = ready_scene(std::move(*scene), needs_of(backend_names()), terminal_progress());
    end_progress();
    if (!ready) return tl::unexpected(ready.error());
    auto renderer = Renderer::create({});
    if (!renderer) return tl::unexpected(renderer.error());
    return Workbench{std::move(*renderer), std::move(*ready)};
}

void fly(benchmark::State& state, Workbench& bench, const Technique& way) {
    auto session = DrawSession::open(bench.scene, *bench.renderer, way, true, {});
    if (!session) return state.SkipWithError(session.error().message.c_str());
    const Budget budget;
    const auto camera = [&](uint32_t frame) { return bench.scene.camera.frame(frame, frames_of_flight); };
    double triangles = 0, invocations = 0, fifo16 = 0;
    uint32_t frame = 0, drawn_frames = 0;
    if (!(*session)->prepare() || !(*session)->settle(camera(0), budget, width, height))
        return state.SkipWithError("nothing can be drawn");
    for (auto _ : state) {
        auto drawn = (*session)->draw(camera(frame), budget, width, height);
        if (!drawn) return state.SkipWithError(drawn.error().message.c_str());
        state.SetIterationTime(drawn->ms / 1000);
        triangles += static_cast<double>(drawn->stats.triangles);
        invocations += static_cast<double>(drawn->counters.camera_vertices());
        fifo16 += simulated_acmr(*(*session)->mirror());
        frame = (frame + 1) % frames_of_flight;
        ++drawn_frames;
    }
    state.counters["FPS"] = benchmark::Counter(drawn_frames, benchmark::Counter::kIsRate);
    state.counters["triangles"] = triangles / drawn_frames;
    state.counters["ACMR"] = triangles > 0 ? invocations / triangles : 0;
    state.counters["ACMR_fifo16"] = fifo16 / drawn_frames;
}

}  // namespace
}  // namespace lodestone

int main(int argc, char** argv) {
    using namespace lodestone;
    benchmark::Initialize(&argc, argv);
    auto bench = make_workbench();
    if (!bench) {
        std::fprintf(stderr, "bench_frame: %s\n", bench.error().message.c_str());
        return static_cast<int>(bench.error().fault);
    }
    for (const std::string& backend : backend_names()) {
        for (const Technique& way : techniques_of(backend, bench->scene)) {
            const std::string name = "flight/" + name_of(way, '/');
            benchmark::RegisterBenchmark(name.c_str(),
                                         [&bench, way](benchmark::State& state) { fly(state, *bench, way); })
                ->UseManualTime()
                ->Unit(benchmark::kMillisecond)
                ->Iterations(2 * frames_of_flight);
        }
    }
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
