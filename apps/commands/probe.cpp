// lodestone probe: the vertex-cache model closest to a device.
#include <algorithm>
#include <cstdio>

#include "apps/commands/commands.h"
#include "apps/options/common_options.h"
#include "apps/options/probed_cache.h"
#include "apps/terminal.h"
#include "base/json.h"
#include "frame/indexed_mesh.h"
#include "mesh/cache/cache_probe.h"
#include "render/renderer.h"

namespace lodestone {

namespace {

struct ProbeArguments {
    std::string device;
    bool json = false, validation = false;
};

// Draws index patterns, the vertices all in one point, so that nothing but vertex shaders has work.
class Counter {
public:
    static Result<Counter> open(const ProbeArguments& o) {
        RendererOptions options;
        options.device = o.device;
        options.width = options.height = 16;
        options.shadow_size = 0;
        options.validation = o.validation;
        auto renderer = Renderer::create(options);
        if (!renderer) return tl::unexpected(renderer.error());
        return Counter(std::move(*renderer));
    }
    Renderer& renderer() { return *renderer_; }

    Result<uint64_t> count(std::span<const uint32_t> indices) {
        Recipe recipe;
        recipe.generation = ++generation_;
        recipe.buffers = {{"probe vertices", probe_vertices * sizeof(MeshVertex), use_vertex, 4},
                          {"probe indices", indices.size_bytes(), use_index, 4}};
        recipe.pipelines = {indexed_mesh_pipeline()};
        if (auto done = renderer_->load(recipe, MaterialSet{{Material{}}, {}}); !done)
            return tl::unexpected(done.error());
        FrameInput input;
        input.views = {view_of(Camera{}, 16, 16)};
        input.instances = {Instance{}};
        input.frame = frame_++;
        Plan plan;
        plan.generation = recipe.generation;
        const auto vertices = std::make_shared<std::vector<MeshVertex>>(probe_vertices);
        const auto copied = std::make_shared<std::vector<uint32_t>>(indices.begin(), indices.end());
        plan.commands.push_back({Stage::update, Upload{0, 0, blob(vertices)}});
        plan.commands.push_back({Stage::update, Upload{1, 0, blob(copied)}});
        IndexedRange range;
        range.vertex_buffer = 0;
        range.index_buffer = 1;
        range.index_count = static_cast<uint32_t>(indices.size());
        range.triangles = range.index_count / 3;
        range.instances = {{0, 1}};
        draw_ranges(plan, input, std::span(&range, 1));
        if (auto done = renderer_->submit(plan, input, ShadingOptions{}); !done) return tl::unexpected(done.error());
        if (auto done = renderer_->wait(); !done) return tl::unexpected(done.error());
        uint64_t runs = 0;
        for (const FrameCounters& counters : renderer_->take_counters())
            runs = counters.pass[static_cast<size_t>(Stage::colour)].vertex_invocations;
        return runs;
    }

private:
    explicit Counter(std::unique_ptr<Renderer> renderer) : renderer_(std::move(renderer)) {}
    template <class T>
    static Blob blob(const std::shared_ptr<std::vector<T>>& values) {
        const auto bytes = std::as_bytes(std::span(*values));
        return Blob(values, bytes.data(), bytes.size());
    }
    std::unique_ptr<Renderer> renderer_;
    uint64_t frame_ = 0;
    uint32_t generation_ = 0;
};

Result<int> probe(const ProbeArguments& o) {
    auto counter = Counter::open(o);
    if (!counter) return tl::unexpected(counter.error());
    const DeviceInfo device = counter->renderer().device();
    const auto result = probe_cache([&](std::span<const uint32_t> indices) { return counter->count(indices); });
    if (!result) return fail_at(device.name, result.error());
    for (const std::string& message : counter->renderer().validation_messages())
        return fail(Fault::invariant, "validation: " + message);
    if (auto done = remember_probe({device.name, device.driver, result->model}); !done)
        return tl::unexpected(done.error());
    if (o.json) {
        Json json = {{"device", device.name},
                     {"driver", device.driver},
                     {"software", device.software},
                     {"cache", name_of(result->model)},
                     {"error", result->error}};
        for (const auto& c : result->candidates)
            json["candidates"].push_back({{"cache", name_of(c.model)}, {"error", c.error}});
        for (const auto& c : result->counts)
            json["patterns"].push_back({{"pattern", c.pattern},
                                        {"triangles", c.triangles},
                                        {"vertex_invocations", c.counted},
                                        {"predicted", c.predicted}});
        print_line(json.dump(2));
        return 0;
    }
    std::printf("%s: closest to %s (%.1f%% off on average); bake --cache auto now aims at it\n", device.name.c_str(),
                name_of(result->model).c_str(), 100 * std::expm1(result->error));
    for (size_t i = 1; i < std::min<size_t>(4, result->candidates.size()); ++i)
        std::printf("  then %-8s %.1f%%\n", name_of(result->candidates[i].model).c_str(),
                    100 * std::expm1(result->candidates[i].error));
    for (const auto& c : result->counts)
        std::printf("  %-24s %8llu vertex runs, %8llu predicted\n", c.pattern.c_str(),
                    static_cast<unsigned long long>(c.counted), static_cast<unsigned long long>(c.predicted));
    return 0;
}

}  // namespace

void add_probe(CLI::App& app, Run& run) {
    const auto o = std::make_shared<ProbeArguments>();
    CLI::App* command = app.add_subcommand(
        "probe", "Find the vertex-cache model closest to a device; bake --cache auto then aims at it");
    command->add_option("--device", o->device,
                        "Number, or part of the name, of a Vulkan device; the first real GPU unless given");
    command->add_flag("--validation", o->validation, "Run under Vulkan validation; exit with 1 if it reports anything");
    command->add_flag("--json", o->json, "Print as JSON, with every candidate and index pattern");
    command->footer(
        examples("lodestone probe\n"
                 "lodestone bake bunny.obj -o bunny.lode --cache auto   # bakes for what it found"));
    command->callback([o, &run] { run = [o] { return probe(*o); }; });
}

}  // namespace lodestone
