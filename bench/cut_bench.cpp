// What a cut through an atlas costs, on one thread, all pages there: nanoseconds per triangle that is drawn (items);
// from scratch, for views from all around at several pixel errors, and going on from the cut before.
#include <benchmark/benchmark.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "base/threads.h"
#include "fixtures/meshes.h"
#include "vgi/bake/bake.h"
#include "vgi/draw/cut/bintree_cut.h"
#include "vgi/draw/cut/chart_tree.h"
#include "vgi/draw/vgi_source.h"
#include "vgi/study/grid_cut.h"

namespace lodestone::vgi {
namespace {

// A rock of a million triangles, 4 samples to each; made once.
const Residency& rock() {
    static const Atlas atlas = [] {
        AtlasOptions options;
        options.clusters.clusters = 60;
        options.cells = 128;
        options.error_samples = 1000;
        AtlasReport report;
        auto made = make_atlas(fixtures::repaired(Shape::rock, 1000000), options, report);
        LODE_CHECK(made.has_value());
        return std::move(*made);
    }();
    static const Residency residency = [] {
        Residency all(atlas);
        for (uint32_t number = 0; number < all.pages(); ++number) {
            const uint32_t chart = number / all.tree().pages(), page = number % all.tree().pages();
            all.put(number,
                    std::make_shared<const GeometryPage>(
                        packed_geometry(read_page(atlas, Layer::geometry, chart, page), all.tree())),
                    number);
        }
        all.update();
        return all;
    }();
    return residency;
}

std::vector<uint32_t> charts_seen(const CutRequest& request) {
    static const ChartTree tree(rock().about());
    return tree.seen(Visibility(request, rock().about()), rock().about());
}

void cut(benchmark::State& state, Raster raster, double pixel_error) {
    const Residency& residency = rock();
    set_thread_count(1);
    std::vector<View> views;
    constexpr int around = 12;
    for (int i = 0; i < around; ++i) {
        const float angle = 6.2831853f * static_cast<float>(i) / around;
        Camera camera;
        camera.eye = 2.6f * glm::vec3(std::cos(angle), 0.3f, std::sin(angle));
        camera.near_plane = 0.05f;
        views.push_back(view_of(camera, 1280, 720));
    }
    uint64_t triangles = 0;
    size_t next = 0;
    IncrementalCut kept;  // the room of it
    for (auto _ : state) {
        CutRequest request;
        request.views = std::span(views).subspan(next++ % around, 1);
        request.pixel_error = pixel_error;
        PageDemand demand(residency.units());
        kept.topology = nullptr;
        const Cut made = raster == Raster::bintree
                             ? cut_bintree(residency, request, charts_seen(request), demand, kept)
                             : cut_grid(residency, request, demand,
                                        raster == Raster::tess ? GridOutput::patches : GridOutput::indices,
                                        raster == Raster::grid_area ? GridRule::by_area : GridRule::by_error);
        triangles += made.triangles;
        benchmark::DoNotOptimize(made.parts.data());
    }
    state.SetItemsProcessed(static_cast<int64_t>(triangles));
    state.counters["triangles"] = static_cast<double>(triangles) / static_cast<double>(state.iterations());
    state.counters["ns_per_triangle"] = benchmark::Counter(static_cast<double>(triangles) * 1e-9,
                                                           benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
    set_thread_count(0);
}

// Round the rock and back, by `degrees` from one cut to the next; each goes on from the one before.
void go_on(benchmark::State& state, double degrees) {
    const Residency& residency = rock();
    set_thread_count(1);
    std::vector<View> views;
    const int around = static_cast<int>(60 / degrees);
    for (int i = 0; i < 2 * around; ++i) {
        const float angle = 0.0174533f * static_cast<float>((i < around ? i : 2 * around - i) * degrees);
        Camera camera;
        camera.eye = 2.6f * glm::vec3(std::cos(angle), 0.3f, std::sin(angle));
        camera.near_plane = 0.05f;
        views.push_back(view_of(camera, 1280, 720));
    }
    uint64_t triangles = 0, taken_over = 0;
    size_t next = 0;
    IncrementalCut kept;
    for (auto _ : state) {
        CutRequest request;
        request.views = std::span(views).subspan(next++ % views.size(), 1);
        PageDemand demand(residency.units());
        const Cut made = cut_bintree(residency, request, charts_seen(request), demand, kept);
        triangles += made.triangles;
        taken_over += kept.taken_over;
        benchmark::DoNotOptimize(made.parts.data());
    }
    state.SetItemsProcessed(static_cast<int64_t>(triangles));
    state.counters["taken_over"] = static_cast<double>(taken_over) / static_cast<double>(triangles);
    state.counters["triangles"] = static_cast<double>(triangles) / static_cast<double>(state.iterations());
    state.counters["ns_per_triangle"] = benchmark::Counter(static_cast<double>(triangles) * 1e-9,
                                                           benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
    set_thread_count(0);
}

BENCHMARK_CAPTURE(cut, bintree_quarter, Raster::bintree, 0.25)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(cut, bintree_1, Raster::bintree, 1.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(cut, bintree_4, Raster::bintree, 4.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(go_on, by_0_0, 1e-3)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(go_on, by_0_1, 0.1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(go_on, by_0_5, 0.5)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(go_on, by_2, 2.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(cut, grid_1, Raster::grid, 1.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(cut, grid_area_1, Raster::grid_area, 1.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(cut, tess_1, Raster::tess, 1.0)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lodestone::vgi

BENCHMARK_MAIN();
