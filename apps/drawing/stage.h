// What the subcommands that draw have in common: their options, the scene made ready and the renderer.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "apps/scene/workplace.h"
#include "render/renderer.h"
#include "report/rows.h"

namespace lodestone {

inline constexpr uint32_t frames_in_flight = 3;  // where frames overlap

struct StageOptions {
    std::string scene, size = "1280x720", device;
    unsigned threads = 0;
    bool validation = false, allow_outside = false, prefix = false;
    // In place of what the scene says.
    std::optional<uint64_t> resident_mib, upload_mib, max_triangles;
    std::string volumes = "on", absorption, environment;
    std::string texture_blocks = "auto";
};
void add_stage_options(CLI::App& command, StageOptions& options);
// What the options set of a budget.
void apply_budget(const StageOptions& options, Budget& budget);

// What can be coloured: its name on the command line, and in the viewer.
struct DebugChoice {
    DebugView view;
    const char* name;
    const char* title;
};
std::span<const DebugChoice> debug_choices();
// "none, level, ... or volume-steps"
std::string debug_names();
// option: what the name was given as, for the error. Fault::usage where there is none of that name.
Result<DebugView> debug_named(const std::string& option, const std::string& name);

struct DrawStage {
    uint32_t width = 0, height = 0;
    RendererOptions options;  // of the renderer
    std::unique_ptr<Renderer> renderer;
    ReadyScene scene;

    // Another device of the same kind in place of one that was lost; what was drawn on that must be gone.
    Result<void> renew_renderer();

    Machine machine() const;
    // "NAME", and whether it is a software rasteriser.
    std::string device_text() const;
    // Tells what validation said; the exit code of a program that did well otherwise.
    int exit_code() const;
};
// Finds out what cannot work before anything is baked. presents: to a window.
Result<DrawStage> set_stage(const StageOptions& options, const SceneNeeds& needs, const Progress& progress,
                            bool presents = false);

}  // namespace lodestone
