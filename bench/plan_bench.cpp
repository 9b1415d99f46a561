// What a plan costs where most of a scene is out of view: CPU of the planning thread and of the threads beside it, per
// frame, by backend. A slow orbit around 20 instances of a rock of 300k triangles, alone and among 10,000, all still or
// 1% of them moving; the same of an atlas of 16 times the charts, most of them out of view; and a flight over a field
// of 10,000 that are in view.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <utility>

#include "base/check.h"
#include "base/cpu_meter.h"
#include "base/random.h"
#include "baseline/full.h"
#include "fixtures/meshes.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"
#include "lod/draw/lod_source.h"
#include "mesh/packed_vertices.h"
#include "vgi/bake/bake.h"
#include "vgi/draw/residency.h"
#include "vgi/draw/vgi_source.h"

namespace lodestone {
namespace {

// PLAN_BENCH_TRIANGLES=20000 for a quick look.
size_t rock_triangles() {
    const char* given = std::getenv("PLAN_BENCH_TRIANGLES");
    return given != nullptr ? static_cast<size_t>(std::atoll(given)) : 300000;
}

const TriMesh& rock() {
    static const TriMesh mesh = fixtures::repaired(Shape::rock, rock_triangles());
    return mesh;
}

std::shared_ptr<const vgi::AtlasFile> atlas_of(const TriMesh& mesh, uint32_t clusters) {
    vgi::AtlasOptions options;
    options.clusters.clusters = clusters;
    options.error_samples = 1000;
    vgi::AtlasReport report;
    const auto atlas = vgi::make_atlas(mesh, options, report);
    LODE_CHECK(atlas.has_value());
    const auto path = std::filesystem::temp_directory_path() / ("lodestone-plan-" + std::to_string(getpid()) + ".lode");
    auto writer = ChunkWriter::create(path, {});
    LODE_CHECK(writer && vgi::write_chunks(*atlas, *writer) && writer->commit());
    const auto file = ChunkFile::open(path);
    LODE_CHECK(file.has_value());
    auto opened = vgi::AtlasFile::open(*file);
    LODE_CHECK(opened.has_value());
    std::filesystem::remove(path);  // it stays mapped
    return std::make_shared<const vgi::AtlasFile>(std::move(*opened));
}

const std::shared_ptr<const vgi::AtlasFile>& rock_atlas() {
    static const auto file = atlas_of(rock(), 60);
    return file;
}

void add_behind(TriMesh& row, const TriMesh& mesh, float z) {
    const auto vertices = static_cast<uint32_t>(row.positions.size()),
               wedges = static_cast<uint32_t>(row.wedge_vertex.size());
    for (const glm::vec3& p : mesh.positions) row.positions.push_back(p - glm::vec3(0, 0, z));
    for (const uint32_t v : mesh.wedge_vertex) row.wedge_vertex.push_back(v + vertices);
    for (const glm::vec3& n : mesh.normals) row.normals.push_back(n);
    for (const Triangle& t : mesh.triangles) row.triangles.push_back({t[0] + wedges, t[1] + wedges, t[2] + wedges});
}

// As many rocks in one mesh, in a row far behind the camera but for the first: farther than it may go before its region
// of views is left (draw/cut/frame_cuts.h), or they would be cut for it, too. A pebble ends the row at the same place
// however many there are: positions are rounded to a lattice over the whole mesh, and errors tell of it.
TriMesh row_of_rocks(uint32_t rocks) {
    TriMesh row;
    for (uint32_t k = 0; k < rocks; ++k) add_behind(row, rock(), k == 0 ? 0 : 30 + 3.0f * static_cast<float>(k));
    TriMesh pebble = fixtures::repaired(Shape::rock, 500);
    for (glm::vec3& p : pebble.positions) p *= 0.05f;
    add_behind(row, pebble, 80);
    return row;
}

struct Subject {
    std::unique_ptr<FrameSource> source;
    std::shared_ptr<const vgi::AtlasFile> file;  // where pages come from
};
Subject open(const std::string& backend, uint32_t instances) {
    const uint64_t plenty = uint64_t{4} << 30;
    Subject subject;
    if (backend == "vgi") {
        subject.file = rock_atlas();
        subject.source = std::move(*vgi::open_vgi({subject.file}, {plenty, instances}));
    } else if (backend == "lod") {
        static const auto pm = [] {
            const auto list = make_quadric_simplifier()->simplify(rock(), {});
            auto made = bake_progressive_mesh(rock(), *list, {"static"});
            made->set_errors(*measure_errors(*made, {20000, 1}));
            return std::make_shared<const ProgressiveMesh>(std::move(*made));
        }();
        subject.source = std::move(*open_lod({pm}, {.resident_bytes = uint64_t{1} << 28, .instances = instances}));
    } else {
        static const auto vertices = pack_vertices(rock());
        static const auto indices = [] {
            std::vector<uint32_t> all;
            for (const Triangle& t : rock().triangles) all.insert(all.end(), t.begin(), t.end());
            return all;
        }();
        subject.source = std::move(*open_fixed_levels({full_level(vertices, indices)}, plenty));
    }
    return subject;
}

// Plans one frame after another; what is asked for is there in the next.
class Planner {
public:
    explicit Planner(const Subject& subject) : subject_(subject) {}

    uint64_t frame() const { return frame_; }
    void plan(FrameInput input) {
        input.frame = frame_++;
        input.completed_frame = input.frame > 1 ? input.frame - 1 : 0;
        input.arrivals = std::exchange(arrivals_, {});
        const double before = thread_cpu_ms();
        const Plan made = subject_.source->plan(input);
        plan_ms_ += thread_cpu_ms() - before;
        triangles_ += static_cast<double>(made.stats.triangles);
        for (const PageRequest& r : made.requests) {
            std::vector<std::byte> part(r.bytes);
            LODE_CHECK(subject_.file->file().read_part(r.chunk, r.offset, part));
            arrivals_.push_back({r.id, Blob(std::move(part))});
        }
    }
    // CPU of all threads, and wall clock, of the frames that `step` plans.
    template <class Step>
    void measure(benchmark::State& state, Step&& step) {
        plan_ms_ = triangles_ = 0;
        const double others = started_threads_cpu_ms();
        const auto start = std::chrono::steady_clock::now();
        for (auto _ : state) {
            const double cpu = plan_ms_ + started_threads_cpu_ms();
            step();
            state.SetIterationTime((plan_ms_ + started_threads_cpu_ms() - cpu) * 1e-3);
        }
        const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
        const auto frames = static_cast<double>(state.iterations());
        state.counters["plan_ms"] = plan_ms_ / frames;
        state.counters["others_ms"] = (started_threads_cpu_ms() - others) / frames;
        state.counters["wall_ms"] = wall.count() / frames;
        state.counters["triangles"] = triangles_ / frames;
    }

private:
    const Subject& subject_;
    std::vector<Arrival> arrivals_;
    double plan_ms_ = 0, triangles_ = 0;
    uint64_t frame_ = 0;
};

enum class Light { none, fitted };  // a shadow view around what is in view

// 20 rocks around the origin, the others far behind the camera.
InstanceSet scene(uint32_t count) {
    Random random(3);
    std::vector<Instance> all(count);
    for (uint32_t i = 0; i < count; ++i) {
        const auto at = [&](double low, double high) { return static_cast<float>(random.uniform(low, high)); };
        glm::mat4& m = all[i].object_to_world;
        m = glm::mat4(0.5f);
        m[3] = i < 20 ? glm::vec4(at(-4, 4), at(-2, 2), at(-4, 4), 1)
                      : glm::vec4(at(-400, 400), at(-20, 20), at(-800, -60), 1);
    }
    return all;
}

void plan(benchmark::State& state, const std::string& backend, uint32_t count, double moving, Light light) {
    const Subject subject = open(backend, count);
    InstanceSet instances = scene(count);
    // Moving ones turn where they are; among 20 alone as many of them as are in view move among 10,000.
    std::vector<uint32_t> movers;
    for (uint32_t i = 0; i < static_cast<uint32_t>(moving * count); ++i) movers.push_back(i * (count / 100));
    if (count == 20 && moving > 0) movers = {0};
    Planner planner(subject);
    const auto step = [&] {
        const float angle = 0.002f * static_cast<float>(planner.frame());
        Camera camera;
        camera.eye = {9 * std::sin(angle), 1, -9 * std::cos(angle)};
        camera.near_plane = 0.05f;
        camera.far_plane = 2000;
        for (const uint32_t i : movers) {
            glm::mat4& m = instances.edit(i).object_to_world;
            m = glm::rotate(m, 0.01f, {0, 1, 0});
        }
        FrameInput input;
        input.views = {view_of(camera, 1280, 720)};
        input.views[0].culls_back_faces = true;
        if (light == Light::fitted) input.views.push_back(shadow_view({-0.4f, -0.8f, -0.45f}, {0, 0, 0}, 6, 2048));
        input.instances = instances;
        planner.plan(std::move(input));
    };
    for (int warm = 0; warm < 40; ++warm) step();
    planner.measure(state, step);
}

// Over 10,000 rocks on a plain, most of them dots.
void plan_of_field(benchmark::State& state) {
    const Subject subject = open("vgi", 10000);
    Random random(1);
    std::vector<Instance> all(10000);
    for (Instance& rock : all) {
        const auto at = [&] { return static_cast<float>(random.uniform(-450, 450)); };
        rock.object_to_world = glm::mat4(static_cast<float>(random.uniform(0.4, 1.6)));
        rock.object_to_world[3] = glm::vec4(at(), 0, at(), 1);
    }
    const InstanceSet instances = all;
    Planner planner(subject);
    const auto step = [&] {
        const float t = static_cast<float>(planner.frame());
        Camera camera;
        camera.eye = {-0.5f * t, 30 - 0.1f * t, 400 - 3.2f * t};
        camera.target = camera.eye + glm::vec3(-0.1f - 0.003f * t, -0.1f, -1);
        camera.near_plane = 0.05f;
        camera.far_plane = 1500;
        FrameInput input;
        input.views = {view_of(camera, 1280, 720), shadow_view({-0.4f, -0.8f, -0.45f}, {0, 0, 0}, 640, 2048)};
        input.views[0].culls_back_faces = true;
        input.instances = instances;
        planner.plan(std::move(input));
    };
    for (int warm = 0; warm < 20; ++warm) step();
    planner.measure(state, step);
}

// The first of a row of rocks, seen from close by; the others are behind the camera.
void plan_of_charts(benchmark::State& state, uint32_t rocks) {
    // Baked once, however often this is repeated.
    static std::map<uint32_t, std::shared_ptr<const vgi::AtlasFile>> baked;
    auto& file = baked[rocks];
    if (file == nullptr) file = atlas_of(row_of_rocks(rocks), 60 * rocks);
    const Subject subject{std::move(*vgi::open_vgi({file}, {uint64_t{4} << 30, 1})), file};
    Planner planner(subject);
    const auto step = [&] {
        Camera camera;
        camera.eye = {0.3f * std::sin(0.01f * static_cast<float>(planner.frame())), 0.1f, -1.6f};
        camera.near_plane = 0.05f;
        FrameInput input;
        input.views = {view_of(camera, 1280, 720)};
        input.views[0].culls_back_faces = true;
        input.instances = {Instance{}};
        planner.plan(std::move(input));
    };
    for (int warm = 0; warm < 60; ++warm) step();
    planner.measure(state, step);
    state.counters["charts"] = file->about().charts();
}

// A page comes, and goes, in an atlas of so many pages: what is known of the pages around it is brought up to date.
void arrival(benchmark::State& state, uint32_t clusters) {
    static std::map<uint32_t, std::shared_ptr<const vgi::AtlasFile>> baked;
    auto& file = baked[clusters];
    if (file == nullptr) file = atlas_of(rock(), clusters);
    const vgi::Atlas& about = file->about();
    vgi::Residency residency(about);
    const auto texels = std::make_shared<const vgi::GeometryPage>(vgi::GeometryPage(33 * 33));
    const uint32_t pages = residency.pages(), per_chart = residency.tree().pages();
    for (uint32_t number = 0; number < pages; ++number) {
        if (residency.tree().level(number % per_chart) > 0) residency.put(number, texels, number);
    }
    residency.update();
    Random random(1);
    std::vector<uint32_t> fine;
    for (uint32_t number = 0; number < pages; ++number) {
        if (residency.tree().level(number % per_chart) == 0) fine.push_back(number);
    }
    for (auto _ : state) {
        const uint32_t number = fine[random.below(static_cast<uint32_t>(fine.size()))];
        residency.put(number, texels, number);
        residency.update();
        residency.drop(number);
        residency.update();
    }
    state.counters["pages"] = pages;
}

}  // namespace
}  // namespace lodestone

int main(int argc, char** argv) {
    using namespace lodestone;
    benchmark::Initialize(&argc, argv);
    for (const char* backend : {"vgi", "lod", "full"}) {
        for (const Light light : {Light::none, Light::fitted}) {
            for (const double moving : {0.0, 0.01}) {
                for (const uint32_t count : {20u, 10000u}) {
                    const std::string name = std::string(backend) + (light == Light::none ? "" : "/shadow") +
                                             (moving > 0 ? "/moving/" : "/still/") + std::to_string(count);
                    benchmark::RegisterBenchmark(name.c_str(), plan, backend, count, moving, light)
                        ->UseManualTime()
                        ->Unit(benchmark::kMillisecond)
                        ->Iterations(60);
                }
            }
        }
    }
    for (const uint32_t rocks : {1u, 16u}) {
        benchmark::RegisterBenchmark(("vgi/rocks_in_one_atlas/" + std::to_string(rocks)).c_str(), plan_of_charts, rocks)
            ->UseManualTime()
            ->Unit(benchmark::kMillisecond)
            ->Iterations(60);
    }
    benchmark::RegisterBenchmark("vgi/field/10000", plan_of_field)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(100);
    for (const uint32_t clusters : {6u, 900u})
        benchmark::RegisterBenchmark(("vgi/arrival/" + std::to_string(clusters)).c_str(), arrival, clusters);
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
