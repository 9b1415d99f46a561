#include "apps/drawing/stage.h"

#include <cstdio>

#include "apps/commands/commands.h"
#include "apps/machine.h"
#include "base/text.h"
#include "base/threads.h"

namespace lodestone {

void add_stage_options(CLI::App& command, StageOptions& options) {
    command.add_option("scene", options.scene, "Scene (.json, glTF), asset (.lode) or mesh")->required();
    command.add_option("--size", options.size, "Size of the picture in pixels, WIDTHxHEIGHT")->capture_default_str();
    command.add_option("--device", options.device,
                       "Number, or part of the name, of a Vulkan device; the first real GPU unless given");
    command.add_option("--threads", options.threads, "Threads for baking, cuts and metrics; 0 takes one per core")
        ->capture_default_str();
    command.add_flag("--validation", options.validation,
                     "Run under Vulkan validation; exit with 1 if it reports anything");
    add_outside_option(command, options.allow_outside);
}

Result<DrawStage> set_stage(const StageOptions& options, const SceneNeeds& needs, const Progress& progress,
                            bool presents) {
    const auto size = parse_size(options.size);
    if (!size) return tl::unexpected(size.error());
    set_thread_count(options.threads);
    auto scene = read_scene(options.scene, options.allow_outside);
    if (!scene) return tl::unexpected(scene.error());
    RendererOptions renderer_options;
    renderer_options.device = options.device;
    renderer_options.width = size->first;
    renderer_options.height = size->second;
    renderer_options.validation = options.validation;
    renderer_options.presents = presents;
    auto renderer = Renderer::create(renderer_options);
    if (!renderer) return tl::unexpected(renderer.error());
    auto ready = ready_scene(std::move(*scene), needs, progress);
    if (!ready) return tl::unexpected(ready.error());
    return DrawStage{size->first, size->second, std::move(*renderer), std::move(*ready)};
}

std::span<const DebugChoice> debug_choices() {
    static constexpr DebugChoice choices[] = {{DebugView::none, "none", "lit"},
                                              {DebugView::level, "level", "level"},
                                              {DebugView::triangle, "triangle", "triangle"},
                                              {DebugView::chart, "chart", "chart"},
                                              {DebugView::page, "page", "page"},
                                              {DebugView::missing, "missing", "missing pages"},
                                              {DebugView::normal, "normal", "normal"},
                                              {DebugView::uv, "uv", "texture coordinates"},
                                              {DebugView::material, "material", "material"},
                                              {DebugView::error, "error", "error in pixels"},
                                              {DebugView::stretch, "stretch", "stretch"},
                                              {DebugView::misses, "misses", "cache misses"}};
    return choices;
}

std::string debug_names() {
    std::string names;
    for (const DebugChoice& choice : debug_choices()) {
        if (&choice == &debug_choices().back()) {
            names += " or ";
        } else if (!names.empty()) {
            names += ", ";
        }
        names += choice.name;
    }
    return names;
}

Machine DrawStage::machine() const {
    const DeviceInfo& device = renderer->device();
    return {cpu_name(), device.name, device.driver, source_commit(), device.software};
}

std::string DrawStage::device_text() const {
    return renderer->device().name + (renderer->device().software ? " (software rasteriser)" : "");
}

int DrawStage::exit_code() const {
    const auto messages = renderer->validation_messages();
    for (const std::string& message : messages) std::fprintf(stderr, "%s\n", printable(message).c_str());
    return messages.empty() ? 0 : static_cast<int>(Fault::invariant);
}

}  // namespace lodestone
