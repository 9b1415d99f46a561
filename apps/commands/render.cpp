#include <charconv>
#include <cstdio>
#include <optional>

#include "apps/commands/commands.h"
#include "apps/drawing/budget_use.h"
#include "apps/drawing/session.h"
#include "apps/drawing/stage.h"
#include "apps/options/common_options.h"
#include "apps/terminal.h"
#include "mesh/io/image_file.h"
#include "report/rows.h"

namespace lodestone {

namespace {

using OrderedJson = nlohmann::ordered_json;

struct RenderArguments {
    StageOptions stage;
    std::string backend = "lod", order, camera, out, stats, debug = "none", raster;
    double pixel_error = 1;
    std::optional<int64_t> level;
    double time = 0;
};

// "PATH", "PATH@T" or "@T": the flight to take, and where on it (0 .. 1).
Result<Camera> choose_camera(const ReadyScene& scene, const std::string& text) {
    if (text.empty()) return usual_camera(scene);
    CameraPath path = scene.camera;
    double t = 0.5;
    const size_t at = text.rfind('@');
    const std::string file = text.substr(0, at);
    if (at != std::string::npos) {
        const char* end = text.data() + text.size();
        if (std::from_chars(text.data() + at + 1, end, t).ptr != end || t < 0 || t > 1) {
            return fail(Fault::usage, "--camera " + text + ": what follows @ must be a number from 0 to 1");
        }
    }
    if (!file.empty()) {
        auto read = read_camera_path(file);
        if (!read) return tl::unexpected(read.error());
        path = *read;
    }
    return path.at(t);
}

uint64_t invocations_of(const DrawnFrame& drawn) {
    uint64_t invocations = 0;
    for (const auto& pass : drawn.counters.pass) invocations += pass.vertices();
    return invocations;
}

OrderedJson stats_of(const DrawnFrame& drawn, const RenderArguments& o, const DrawStage& stage) {
    OrderedJson stats;
    stats["machine"] = json_of(stage.machine());
    stats["rows"] = {{{"backend", o.backend},
                      {"order", o.order},
                      {"raster", o.raster},
                      {"pixel_error", o.pixel_error},
                      {"frames", 1},
                      {"ms_median", drawn.ms},
                      {"cpu_plan_ms", drawn.plan_cpu_ms},
                      {"gpu_ms", drawn.counters.gpu_ms},
                      {"uploaded_bytes", drawn.stats.uploaded_bytes},
                      {"resident_bytes", drawn.stats.resident_bytes},
                      {"index_bytes", drawn.stats.index_bytes},
                      {"buffer_bytes", stage.renderer->buffer_bytes()},
                      {"triangles", drawn.stats.triangles},
                      {"vertex_invocations", invocations_of(drawn)},
                      {"acmr", drawn.stats.triangles ? static_cast<double>(drawn.counters.camera_vertices()) /
                                                           static_cast<double>(drawn.stats.triangles)
                                                     : 0},
                      {"instances_drawn", drawn.stats.instances_drawn},
                      {"asset_bytes", stage.scene.asset_bytes}}};
    OrderedJson& row = stats["rows"][0];
    for (int s = 0; s < stage_count; ++s) {
        const auto& pass = drawn.counters.pass[static_cast<size_t>(s)];
        row["stages"][name_of(static_cast<Stage>(s))] = {{"gpu_ms", pass.gpu_ms},
                                                         {"vertex_invocations", pass.vertices()}};
    }
    for (const auto& [name, value] : drawn.stats.more) row["backend_figures"][name] = value;
    if (drawn.volume) row["volume"] = json_of(*drawn.volume);
    return stats;
}

struct DrawnPicture {
    Image picture;
    std::string stats;  // JSON, where it is asked for
    std::string line;   // of what was drawn
    int exit_code = 0;
};

// Nothing is written before the scene and the device have been taken down, for which memory may run out, too.
Result<DrawnPicture> make_picture(const RenderArguments& o) {
    const auto debug = debug_named("--debug", o.debug);
    if (!debug) return tl::unexpected(debug.error());
    if (auto known = check_backend("--backend", o.backend); !known) return tl::unexpected(known.error());
    if (auto known = check_raster("--raster", o.raster, o.backend); !known) return tl::unexpected(known.error());
    const Progress progress = terminal_progress();
    SceneNeeds needs = needs_of({o.backend});
    note_rasters({o.raster}, needs);
    needs.quickly = o.order.empty();
    auto stage = set_stage(o.stage, needs, progress);
    if (!stage) return tl::unexpected(stage.error());
    const ReadyScene& ready = stage->scene;
    Renderer& renderer = *stage->renderer;
    auto camera = choose_camera(ready, o.camera);
    if (!camera) return tl::unexpected(camera.error());

    progress.at("draw on " + renderer.device().name, 0);
    auto session =
        DrawSession::open(ready, renderer, {o.backend, o.order, o.raster}, *debug == DebugView::misses, progress);
    if (!session) return tl::unexpected(session.error());
    (*session)->look.debug = *debug;
    (*session)->time = o.time;
    Budget budget = ready.scene.budget;
    budget.pixel_error = o.pixel_error;
    budget.forced_level = o.level.value_or(-1);
    auto drawn = (*session)->settle(*camera, budget, stage->width, stage->height);
    if (!drawn) return tl::unexpected(drawn.error());
    // What the first frame needs is uploaded whatever the budget.
    BudgetUse use = use_of(drawn->stats);
    use.upload_bytes = 0;
    for (const std::string& line : beyond(budget, use, o.backend)) progress.warning(line);
    auto picture = renderer.read_picture();
    if (!picture) return tl::unexpected(picture.error());
    DrawnPicture made;
    made.picture = opaque_image(*picture);
    if (!o.stats.empty()) made.stats = stats_of(*drawn, o, *stage).dump(2);
    made.line = o.out + ": " + std::to_string(drawn->stats.triangles) + " triangles, " +
                std::to_string(invocations_of(*drawn)) + " vertex invocations, on " + stage->device_text();
    made.exit_code = stage->exit_code();
    return made;
}

Result<int> render(const RenderArguments& o) {
    const auto made = make_picture(o);
    if (!made) return tl::unexpected(made.error());
    if (auto done = write_png(made->picture, o.out); !done) return tl::unexpected(done.error());
    end_progress();
    if (!o.stats.empty()) {
        if (auto done = write_json(o.stats, made->stats); !done) return tl::unexpected(done.error());
    }
    if (verbosity() != Verbosity::quiet) std::printf("%s\n", made->line.c_str());
    return made->exit_code;
}

}  // namespace

void add_render(CLI::App& app, Run& run) {
    const auto o = std::make_shared<RenderArguments>();
    CLI::App* command = app.add_subcommand("render", "Draw one picture of a scene, an asset or a mesh");
    add_stage_options(*command, o->stage);
    command->add_option("--backend", o->backend, "full, discrete, lod (progressive mesh) or vgi (geometry images)")
        ->capture_default_str();
    command->add_option("--order", o->order, "lod: face order to draw; the asset's first unless given");
    command->add_option(
        "--raster", o->raster,
        "How triangles are made. vgi: bintree (unless given), grid, grid-area, tess or device; lod: geomorph "
        "(vertices move gradually)");
    auto* error = command->add_option("--pixel-error", o->pixel_error, "Largest error on screen, in pixels")
                      ->check(CLI::Range(1e-6, 1e6))
                      ->capture_default_str();
    command->add_option("--level", o->level, "Draw this level instead, everywhere; 0 is full detail")
        ->check(CLI::NonNegativeNumber)
        ->excludes(error);
    command->add_option("--camera", o->camera,
                        "Camera path, and how far along it: PATH, PATH@T or @T, T from 0 to 1; unless given @0.5 of "
                        "the scene's own path, "
                        "or, where it has none, with everything in the frame");
    command->add_option("--time", o->time, "Seconds: what smoke and fire of the scene look like then")
        ->capture_default_str();
    command->add_option("--debug", o->debug, "Colour by this: " + debug_names())->capture_default_str();
    command->add_option("-o,--out", o->out, "PNG to write")->required();
    command->add_option("--stats", o->stats, "Also write counts and times to this JSON file");
    command->footer(
        examples("lodestone render bunny.obj --backend lod --pixel-error 1 -o bunny.png\n"
                 "lodestone render atlas.lode --backend vgi --raster grid --debug error -o error.png\n"
                 "lodestone render assets/rock.scene.json --camera @0.9 --stats stats.json -o near.png"));
    command->callback([o, &run] { run = [o] { return render(*o); }; });
}

}  // namespace lodestone
