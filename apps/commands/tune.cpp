#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/commands/commands.h"
#include "apps/drawing/flight.h"
#include "apps/drawing/stage.h"
#include "apps/options/common_options.h"
#include "apps/terminal.h"
#include "base/statistics.h"
#include "report/error_search.h"

namespace lodestone {

namespace {

using OrderedJson = nlohmann::ordered_json;

struct TuneArguments {
    StageOptions stage;
    std::string backend = "lod", order, raster, turn = "error";
    double fps = 60, pixel_error = 1;
    uint32_t frames = 60;
    bool json = false;
};

constexpr double near_by = 0.15;  // of the frame's time: worth another look

// Flights at a pixel error and a quality of volumes, whose frames overlap.
struct Tried {
    double pixel_error;
    uint32_t volumes;  // volume::at_level; 0: as the scene has them
    double period_median_ms, period_p95_ms, triangles, cpu_plan_ms, gpu_ms;
};

class Tuner {
public:
    Tuner(DrawSession& session, const Flight& flight, double target_ms, const Progress& progress)
        : session_(session), flight_(flight), target_ms_(target_ms), progress_(progress) {}

    // The median period of frames flown at an error, ms; flown twice where it may be the answer.
    Result<double> median_ms_at(double error) {
        char label[64];
        std::snprintf(label, sizeof label, "at %.3g px", error);
        return median_ms(error, 0, label);
    }
    // The same at a quality of volumes.
    Result<double> median_ms_at(double error, uint32_t volumes) {
        session_.volumes()->quality = volume::at_level(session_.volumes()->quality, volumes);
        return median_ms(error, volumes, "volumes at " + std::to_string(volumes));
    }

    std::vector<Tried> tried;

private:
    Result<double> median_ms(double error, uint32_t volumes, const std::string& label) {
        flight_.budget.pixel_error = error;
        std::vector<FlownFrame> all;
        Tried now{};
        for (int time = 0; time < 2; ++time) {
            const auto flown = fly(session_, flight_, label, progress_);
            if (!flown) return tl::unexpected(flown.error());
            all.insert(all.end(), flown->begin(), flown->end());
            const auto ms = of_frames(all, [](const FlownFrame& f) { return f.period_ms; });
            now = {error,
                   volumes,
                   median(ms),
                   percentile(ms, 0.95),
                   mean(of_frames(all, [](const FlownFrame& f) { return f.triangles; })),
                   mean(of_frames(all, [](const FlownFrame& f) { return f.plan_cpu_ms; })),
                   median(of_frames(all, [](const FlownFrame& f) { return f.gpu_ms; }))};
            if (std::abs(now.period_median_ms / target_ms_ - 1) > near_by) break;
        }
        tried.push_back(now);
        return now.period_median_ms;
    }

    DrawSession& session_;
    Flight flight_;
    double target_ms_;
    const Progress& progress_;
};

// What the search has found, and the same flight with the controller at the wheel.
struct Tuned {
    std::vector<Tried> tried;
    Tried best;
    bool holds = false;
    std::vector<FlownFrame> alone;         // at the best, one frame in flight
    FrameRates rates;                      // at the best, where frames overlap
    std::vector<double> ms, pixel_errors;  // of the flight that was steered, per frame
};

OrderedJson json_of(const Tuned& tuned, const TuneArguments& o, const DrawStage& stage) {
    OrderedJson json;
    json["machine"] = json_of(stage.machine());
    json["backend"] = o.backend;
    json["order"] = o.order;
    json["raster"] = o.raster;
    json["size"] = o.stage.size;
    json["fps"] = o.fps;
    json["frames"] = o.frames;
    json["turn"] = o.turn;
    json["pixel_error"] = tuned.best.pixel_error;
    if (o.turn == "volumes") json["volumes"] = tuned.best.volumes;
    json["holds"] = tuned.holds;
    const auto ms = of_frames(tuned.alone, [](const FlownFrame& f) { return f.ms; });
    json["ms_median"] = median(ms);
    json["ms_p95"] = percentile(ms, 0.95);
    json["fps_median"] = 1000 / tuned.best.period_median_ms;
    json["throughput_fps"] = tuned.rates.mean;
    json["throughput_fps_min"] = tuned.rates.least;
    json["throughput_fps_max"] = tuned.rates.most;
    json["frames_in_flight"] = frames_in_flight;
    for (const Tried& t : tuned.tried) {
        json["tried"].push_back({{"pixel_error", t.pixel_error},
                                 {"volumes", t.volumes},
                                 {"period_median_ms", t.period_median_ms},
                                 {"period_p95_ms", t.period_p95_ms},
                                 {"triangles", t.triangles},
                                 {"cpu_plan_ms", t.cpu_plan_ms},
                                 {"gpu_ms", t.gpu_ms}});
    }
    if (!tuned.ms.empty())
        json["controlled"] = {{"ms_median", median(tuned.ms)},
                              {"ms_p95", percentile(tuned.ms, 0.95)},
                              {"ms", tuned.ms},
                              {"pixel_error", tuned.pixel_errors}};
    return json;
}

void print_summary(const Tuned& tuned, const TuneArguments& o, const std::string& device) {
    char line[256];
    if (o.turn == "volumes") {
        std::snprintf(
            line, sizeof line,
            "%s: smoke and fire of quality %u hold %g frames per second on %s: median %.2f ms (%.1f per second)",
            o.backend.c_str(), tuned.best.volumes, o.fps, device.c_str(), tuned.best.period_median_ms,
            1000 / tuned.best.period_median_ms);
        print_line(line);
        print_line("draw with it by --volumes " + std::to_string(tuned.best.volumes));
        return;
    }
    std::snprintf(line, sizeof line,
                  "%s: a pixel error of %.3g holds %g frames per second on %s: median %.2f ms (%.1f per second)",
                  o.backend.c_str(), tuned.best.pixel_error, o.fps, device.c_str(), tuned.best.period_median_ms,
                  1000 / tuned.best.period_median_ms);
    print_line(line);
    std::snprintf(line, sizeof line, "steered frame by frame: median %.2f ms with errors from %.3g to %.3g px",
                  median(tuned.ms), percentile(tuned.pixel_errors, 0), percentile(tuned.pixel_errors, 1));
    print_line(line);
}

// What holds the time, and all that was tried.
Result<Tuned> search(Tuner& tuner, DrawSession& session, const TuneArguments& o, const ErrorController::Range& range) {
    const double target_ms = 1000 / o.fps;
    if (o.turn == "error") {
        const FrameTimeSearch wanted{.target_ms = target_ms, .least = range.least, .most = range.most};
        const auto found = error_that_holds(wanted, [&](double error) { return tuner.median_ms_at(error); });
        if (!found) return tl::unexpected(found.error());
        return Tuned{tuner.tried, tuner.tried[found->which], found->holds, {}, {}, {}, {}};
    }
    const auto found = level_that_holds(volume::lowest_level, volume::highest_level, target_ms,
                                        [&](uint32_t level) { return tuner.median_ms_at(o.pixel_error, level); });
    if (!found) return tl::unexpected(found.error());
    session.volumes()->quality = volume::at_level(session.volumes()->quality, found->level);
    const auto best = std::ranges::find(tuner.tried, found->level, &Tried::volumes);
    return Tuned{tuner.tried, *best, found->holds, {}, {}, {}, {}};
}

Result<Tuned> tune(DrawStage& stage, const TuneArguments& o, const ErrorController::Range& range,
                   const Progress& progress) {
    auto session = DrawSession::open(stage.scene, *stage.renderer, {o.backend, o.order, o.raster}, false, progress);
    if (!session) return tl::unexpected(session.error());
    const double target_ms = 1000 / o.fps;
    Flight flight{&stage.scene.camera, o.frames, stage.scene.scene.budget, stage.width, stage.height, nullptr, true};
    Tuner tuner(**session, flight, target_ms, progress);
    auto tuned = search(tuner, **session, o, range);
    if (!tuned) return tuned;

    flight.budget.pixel_error = tuned->best.pixel_error;
    for (const bool overlaps : {false, true}) {
        flight.overlaps = overlaps;
        auto flown = fly(**session, flight, "found", progress);
        if (!flown) return tl::unexpected(flown.error());
        for (const std::string& line : beyond(flight.budget, use_of(*flown), o.backend)) progress.warning(line);
        if (overlaps) {
            tuned->rates = frame_rates(*flown);
        } else {
            tuned->alone = std::move(*flown);
        }
    }
    if (o.turn == "volumes") return tuned;
    ErrorController controller(target_ms, tuned->best.pixel_error, range);
    flight.controller = &controller;
    const auto held = fly(**session, flight, "controlled", progress);
    if (!held) return tl::unexpected(held.error());
    tuned->ms = of_frames(*held, [](const FlownFrame& f) { return f.period_ms; });
    tuned->pixel_errors = of_frames(*held, [](const FlownFrame& f) { return f.pixel_error; });
    return tuned;
}

// What cannot be turned, before anything is baked.
Result<void> check(const TuneArguments& o) {
    if (auto known = check_backend("--backend", o.backend); !known) return known;
    if (o.turn == "error" && o.backend == "full")
        return fail(Fault::usage, "--backend full: has one level and no error to tune; choose discrete, lod or vgi");
    return check_raster("--raster", o.raster, o.backend);
}

// Why the time is not held.
std::string too_slow(const Tuned& tuned, const TuneArguments& o, const ErrorController::Range& range) {
    char line[256];
    if (o.turn == "volumes") {
        std::snprintf(line, sizeof line,
                      "%s cannot be drawn %g times a second here: with the cheapest smoke and fire it takes %.2f ms a "
                      "frame; ask for fewer, or for a smaller --size, or leave them out by --volumes off",
                      o.stage.scene.c_str(), o.fps, tuned.best.period_median_ms);
    } else {
        std::snprintf(line, sizeof line,
                      "%s cannot be drawn %g times a second here: of all errors up to %g px the fastest, %g px, takes "
                      "%.2f ms a frame; ask for fewer, or for a smaller --size",
                      o.stage.scene.c_str(), o.fps, range.most, tuned.best.pixel_error, tuned.best.period_median_ms);
    }
    return line;
}

Result<int> tune(const TuneArguments& o) {
    if (auto good = check(o); !good) return tl::unexpected(good.error());
    const Progress progress = terminal_progress();
    SceneNeeds needs = needs_of({o.backend});
    note_rasters({o.raster}, needs);
    auto stage = set_stage(o.stage, needs, progress);
    if (!stage) return tl::unexpected(stage.error());
    if (o.turn == "volumes" && stage->scene.scene.volumes.emitters.empty())
        return fail(Fault::usage, "--turn volumes: the scene draws no smoke or fire");
    const ErrorController::Range range;
    const auto tuned = tune(*stage, o, range, progress);
    if (!tuned) return tl::unexpected(tuned.error());
    end_progress();
    if (o.json) {
        print_line(json_of(*tuned, o, *stage).dump(2));
    } else if (tuned->holds) {
        print_summary(*tuned, o, stage->device_text());
    }
    if (tuned->holds) return stage->exit_code();
    return fail(Fault::machine, too_slow(*tuned, o, range));
}

}  // namespace

void add_tune(CLI::App& app, Run& run) {
    const auto o = std::make_shared<TuneArguments>();
    CLI::App* command = app.add_subcommand(
        "tune", "Find the pixel error, or the quality of smoke and fire, that holds a frame rate on this machine");
    add_stage_options(*command, o->stage);
    command->add_option("--fps", o->fps, "Frames per second to hold")
        ->check(CLI::Range(0.1, 100000.0))
        ->capture_default_str();
    command
        ->add_option("--turn", o->turn,
                     "What is looked for: error, the smallest pixel error that holds the frame rate; or volumes, the "
                     "highest quality of smoke and fire that does, at --pixel-error")
        ->check(CLI::IsMember({"error", "volumes"}))
        ->capture_default_str();
    command->add_option("--pixel-error", o->pixel_error, "Largest error on screen in pixels, with --turn volumes")
        ->check(CLI::Range(1e-3, 1e6))
        ->capture_default_str();
    command
        ->add_option("--backend", o->backend,
                     "full (with --turn volumes), discrete, lod (progressive mesh) or vgi (geometry images)")
        ->capture_default_str();
    command->add_option("--order", o->order, "lod: face order to draw; the asset's first unless given");
    command->add_option(
        "--raster", o->raster,
        "How triangles are made. vgi: bintree (unless given), grid, grid-area, tess or device; lod: geomorph "
        "(vertices move gradually)");
    command->add_option("--frames", o->frames, "Frames of each flight")
        ->check(CLI::Range(1u, 1000000u))
        ->capture_default_str();
    command->add_flag("--json", o->json, "Print as JSON: the pixel error found, each flight, the steered flight");
    command->footer(
        examples("lodestone tune assets/rock.scene.json --backend vgi --fps 60\n"
                 "lodestone tune assets/smoke.scene.json --turn volumes --fps 4"));
    command->callback([o, &run] { run = [o] { return tune(*o); }; });
}

}  // namespace lodestone
