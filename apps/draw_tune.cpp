#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/commands.h"
#include "apps/draw_flight.h"
#include "apps/draw_stage.h"
#include "apps/terminal.h"
#include "base/statistics.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;

struct Options {
    StageOptions stage;
    std::string backend = "lod", order, raster;
    double fps = 60;
    uint32_t frames = 60;
    bool json = false;
};

constexpr double close_enough = 0.03;  // of the frame's time
constexpr double near_by = 0.15;       // of the frame's time: worth another look
constexpr uint32_t most_flights = 12;

struct Tried {
    double pixel_error, ms_median, ms_p95, triangles, cpu_plan_ms, gpu_ms;
};

class Tuner {
public:
    Tuner(DrawSession& session, const Flight& flight, double target_ms, const Progress& progress)
        : session_(session), flight_(flight), target_ms_(target_ms), progress_(progress) {}

    // Tries errors until one holds the target or the range ends; the best of them.
    Result<Tried> search(const ErrorController::Range& range) {
        double error = 1;
        std::optional<Tried> slow, fast;  // the errors tried next to the one looked for, from both sides
        while (tried.size() < most_flights) {
            auto now = fly_at(error);
            if (!now) return tl::unexpected(now.error());
            if (std::abs(now->ms_median / target_ms_ - 1) < close_enough) return now;
            (now->ms_median > target_ms_ ? slow : fast) = *now;
            if (slow && fast) {
                // Where a power law through both would hit, but not at the very ends.
                const double share =
                    std::log(slow->ms_median / target_ms_) / std::log(slow->ms_median / fast->ms_median);
                const double width = std::log(fast->pixel_error / slow->pixel_error);
                if (width < 0.02) break;
                error = slow->pixel_error * std::exp(width * std::clamp(share, 0.1, 0.9));
            } else {
                const double end = slow ? range.most : range.least;
                if (now->pixel_error == end) break;
                error =
                    std::clamp(now->pixel_error * std::pow(now->ms_median / target_ms_, 2.0) * (slow ? 1.2 : 1 / 1.2),
                               range.least, range.most);
            }
        }
        return *std::ranges::min_element(tried, {},
                                         [&](const Tried& t) { return std::abs(std::log(t.ms_median / target_ms_)); });
    }

    std::vector<Tried> tried;

private:
    // Flown twice where it may be the answer.
    Result<Tried> fly_at(double error) {
        flight_.budget.pixel_error = error;
        char label[64];
        std::snprintf(label, sizeof label, "at %.3g px", error);
        std::vector<FlownFrame> all;
        Tried now{};
        for (int time = 0; time < 2; ++time) {
            const auto flown = fly(session_, flight_, label, progress_);
            if (!flown) return tl::unexpected(flown.error());
            all.insert(all.end(), flown->begin(), flown->end());
            const auto ms = of_frames(all, [](const FlownFrame& f) { return f.ms; });
            now = {error,
                   median(ms),
                   percentile(ms, 0.95),
                   mean(of_frames(all, [](const FlownFrame& f) { return f.triangles; })),
                   mean(of_frames(all, [](const FlownFrame& f) { return f.plan_cpu_ms; })),
                   median(of_frames(all, [](const FlownFrame& f) { return f.gpu_ms; }))};
            if (std::abs(now.ms_median / target_ms_ - 1) > near_by) break;
        }
        tried.push_back(now);
        return now;
    }

    DrawSession& session_;
    Flight flight_;
    double target_ms_;
    const Progress& progress_;
};

Result<int> tune(const Options& o) {
    if (auto known = check_backend("--backend", o.backend); !known) return tl::unexpected(known.error());
    if (o.backend == "full")
        return fail(Fault::usage, "--backend full: has one level and no error to tune; choose discrete, lod or vgi");
    if (auto known = check_raster("--raster", o.raster, o.backend); !known) return tl::unexpected(known.error());
    const Progress progress = terminal_progress();
    auto stage = set_stage(o.stage, needs_of({o.backend}), progress);
    if (!stage) return tl::unexpected(stage.error());
    auto session = DrawSession::open(stage->scene, *stage->renderer, {o.backend, o.order, o.raster}, false, progress);
    if (!session) return tl::unexpected(session.error());

    const double target_ms = 1000 / o.fps;
    const ErrorController::Range range;
    Flight flight{&stage->scene.camera, o.frames, {}, stage->width, stage->height, nullptr};
    flight.budget.resident_bytes = stage->scene.scene.resident_bytes;
    Tuner tuner(**session, flight, target_ms, progress);
    const auto best = tuner.search(range);
    if (!best) return tl::unexpected(best.error());

    // The same flight with the controller at the wheel.
    ErrorController controller(target_ms, best->pixel_error, range);
    flight.controller = &controller;
    const auto held = fly(**session, flight, "controlled", progress);
    if (!held) return tl::unexpected(held.error());
    const auto held_ms = of_frames(*held, [](const FlownFrame& f) { return f.ms; });
    end_progress();

    const bool too_slow = best->ms_median > target_ms * (1 + close_enough) && best->pixel_error >= range.most * 0.99;
    if (o.json) {
        Json json;
        json["machine"] = json_of(stage->machine());
        json["backend"] = o.backend;
        json["order"] = o.order;
        json["raster"] = o.raster;
        json["size"] = o.stage.size;
        json["fps"] = o.fps;
        json["frames"] = o.frames;
        json["pixel_error"] = best->pixel_error;
        json["holds"] = !too_slow;
        json["ms_median"] = best->ms_median;
        json["ms_p95"] = best->ms_p95;
        json["fps_median"] = 1000 / best->ms_median;
        for (const Tried& t : tuner.tried) {
            json["tried"].push_back({{"pixel_error", t.pixel_error},
                                     {"ms_median", t.ms_median},
                                     {"ms_p95", t.ms_p95},
                                     {"triangles", t.triangles},
                                     {"cpu_plan_ms", t.cpu_plan_ms},
                                     {"gpu_ms", t.gpu_ms}});
        }
        json["controlled"] = {{"ms_median", median(held_ms)},
                              {"ms_p95", percentile(held_ms, 0.95)},
                              {"ms", held_ms},
                              {"pixel_error", of_frames(*held, [](const FlownFrame& f) { return f.pixel_error; })}};
        print_line(json.dump(2));
    } else if (!too_slow) {
        const auto errors = of_frames(*held, [](const FlownFrame& f) { return f.pixel_error; });
        char line[256];
        std::snprintf(line, sizeof line,
                      "%s: a pixel error of %.3g holds %g frames per second on %s: median %.2f ms (%.1f per second)",
                      o.backend.c_str(), best->pixel_error, o.fps, stage->device_text().c_str(), best->ms_median,
                      1000 / best->ms_median);
        print_line(line);
        std::snprintf(line, sizeof line, "steered frame by frame: median %.2f ms with errors from %.3g to %.3g px",
                      median(held_ms), percentile(errors, 0), percentile(errors, 1));
        print_line(line);
    }
    if (!too_slow) return stage->exit_code();
    char line[256];
    std::snprintf(
        line, sizeof line,
        "%s cannot be drawn %g times a second here: even at %g px a frame takes %.2f ms; ask for fewer, or for a "
        "smaller --size",
        o.stage.scene.c_str(), o.fps, best->pixel_error, best->ms_median);
    return fail(Fault::machine, line);
}

}  // namespace

void add_tune(CLI::App& app, Run& run) {
    const auto o = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("tune", "Find the pixel error that holds a frame rate on this machine");
    add_stage_options(*command, o->stage);
    command->add_option("--fps", o->fps, "Frames per second to hold")
        ->check(CLI::Range(0.1, 100000.0))
        ->capture_default_str();
    command->add_option("--backend", o->backend, "discrete, lod or vgi")->capture_default_str();
    command->add_option("--order", o->order, "lod: face order to draw");
    command->add_option("--raster", o->raster, "vgi: bintree, grid or tess; lod: geomorph");
    command->add_option("--frames", o->frames, "Frames of every flight")
        ->check(CLI::Range(1u, 1000000u))
        ->capture_default_str();
    command->add_flag("--json", o->json, "Print a JSON document: the error, every flight, the controlled flight");
    command->footer(examples("lodestone tune assets/rock.scene.json --backend vgi --fps 60"));
    command->callback([o, &run] { run = [o] { return tune(*o); }; });
}

}  // namespace lodestone
