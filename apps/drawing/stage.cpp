#include "apps/drawing/stage.h"

#include <cstdio>

#include "apps/drawing/environment.h"
#include "apps/drawing/grids.h"
#include "apps/machine.h"
#include "apps/options/common_options.h"
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
    command
        .add_option("--resident-mib", options.resident_mib,
                    "MiB that the buffers of a backend may take together; what the scene says unless given, or 1024")
        ->check(CLI::Range(uint64_t{1}, most_mib));
    command
        .add_option("--upload-mib", options.upload_mib,
                    "MiB that a frame may upload, once the first is drawn; what the scene says unless given, or any")
        ->check(CLI::Range(uint64_t{1}, most_mib));
    command
        .add_option("--max-triangles", options.max_triangles,
                    "Triangles that a picture may have; the pixel error rises to keep to it. What the scene says "
                    "unless given, or any. Where a backend cannot go so low, what it reached is told")
        ->check(CLI::Range(uint64_t{1}, most_triangles));
    command
        .add_option("--volumes", options.volumes,
                    "How smoke and fire are drawn: on, as the scene says; off, not at all; reference, metavoxel by "
                    "metavoxel as their source does, which needs no room for all of them; or a quality, from 1, the "
                    "cheapest, to 8. bench takes several, separated by commas, and has rows for each")
        ->capture_default_str();
    command
        .add_option(
            "--absorption", options.absorption,
            "How smoke takes light away: exp, by its length; or rational, 1/(1+density) a step, which depends on "
            "the steps. What the scene says unless given, or exp")
        ->check(CLI::IsMember({"exp", "rational"}));
    command.add_option("--environment", options.environment,
                       "Light from all around, and what is seen behind everything: sky, a clear one whose sun stands "
                       "where the light comes from; a Radiance picture (.hdr), equirectangular; or none, a sky and a "
                       "ground of one colour each. What the scene says unless given, or none");
    command
        .add_option("--texture-blocks", options.texture_blocks,
                    "vgi: baked textures take about half of the memory, as block compressed textures, and are a little "
                    "less exact: on, off, or auto, on where the device is no software rasteriser")
        ->check(CLI::IsMember({"auto", "on", "off"}))
        ->capture_default_str();
    command.add_flag("--validation", options.validation,
                     "Run under Vulkan validation; exit with 1 if it reports anything");
    add_outside_option(command, options.allow_outside);
    add_prefix_option(command, options.prefix);
}

void apply_budget(const StageOptions& options, Budget& budget) {
    if (options.resident_mib) budget.resident_bytes = *options.resident_mib << 20;
    if (options.upload_mib) budget.upload_bytes = *options.upload_mib << 20;
    if (options.max_triangles) budget.max_triangles = *options.max_triangles;
}

Result<DrawStage> set_stage(const StageOptions& options, const SceneNeeds& needs, const Progress& progress,
                            bool presents) {
    const auto size = parse_size(options.size);
    if (!size) return tl::unexpected(size.error());
    set_thread_count(options.threads);
    auto scene = read_scene(options.scene, options.allow_outside);
    if (!scene) return tl::unexpected(scene.error());
    apply_budget(options, scene->budget);
    if (options.prefix) scene->extent = Extent::prefix;
    if (options.volumes == "off") {
        scene->volumes = {};
    } else if (auto done = choose_volumes("--volumes", options.volumes, scene->volumes.quality); !done) {
        return tl::unexpected(done.error());
    }
    if (auto grids = read_grids(scene->volumes); !grids) return tl::unexpected(grids.error());
    if (!options.absorption.empty())
        scene->volumes.quality.absorption =
            options.absorption == "exp" ? volume::Absorption::exponential : volume::Absorption::rational;
    if (!options.environment.empty()) scene->environment = options.environment;
    auto environment = environment_of(*scene);
    if (!environment) return tl::unexpected(environment.error());
    RendererOptions renderer_options;
    renderer_options.device = options.device;
    renderer_options.width = size->first;
    renderer_options.height = size->second;
    renderer_options.validation = options.validation;
    renderer_options.presents = presents;
    renderer_options.frames_in_flight = frames_in_flight;
    auto renderer = Renderer::create(renderer_options);
    if (!renderer) return tl::unexpected(renderer.error());
    auto ready = ready_scene(std::move(*scene), needs, progress);
    if (!ready) return tl::unexpected(ready.error());
    ready->materials.environment = std::move(*environment);
    ready->textures_in_blocks =
        options.texture_blocks == "on" || (options.texture_blocks == "auto" && !(*renderer)->device().software);
    return DrawStage{size->first, size->second, renderer_options, std::move(*renderer), std::move(*ready)};
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
                                              {DebugView::leaf, "leaf", "leaves"},
                                              {DebugView::misses, "misses", "cache misses"},
                                              {DebugView::base_colour, "base-colour", "base colour"},
                                              {DebugView::alpha, "alpha", "alpha"},
                                              {DebugView::metallic, "metallic", "metal"},
                                              {DebugView::roughness, "roughness", "roughness"},
                                              {DebugView::occlusion, "occlusion", "occlusion"},
                                              {DebugView::emission, "emission", "emission"},
                                              {DebugView::volume_bricks, "volume-bricks", "bricks of volumes"},
                                              {DebugView::volume_occupancy, "volume-occupancy", "occupancy of volumes"},
                                              {DebugView::volume_light, "volume-light", "light in volumes"},
                                              {DebugView::volume_steps, "volume-steps", "steps through volumes"}};
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

Result<DebugView> debug_named(const std::string& option, const std::string& name) {
    for (const DebugChoice& choice : debug_choices()) {
        if (name == choice.name) return choice.view;
    }
    return fail(Fault::usage, option + " " + name + ": choose " + debug_names());
}

Result<void> DrawStage::renew_renderer() {
    renderer.reset();
    auto made = Renderer::create(options);
    if (!made) return tl::unexpected(made.error());
    renderer = std::move(*made);
    return {};
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
