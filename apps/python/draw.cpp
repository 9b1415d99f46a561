#include "apps/python/draw.h"

#ifdef LODESTONE_WITH_RENDER
#include <algorithm>

#include "apps/drawing/environment.h"
#include "apps/drawing/session.h"
#include "apps/drawing/stage.h"
#include "apps/scene/backends.h"
#include "apps/scene/workplace.h"
#include "render/renderer.h"
#endif

namespace lodestone {

#ifdef LODESTONE_WITH_RENDER

namespace {

// The asset alone at the origin.
ReadyScene scene_of(const Asset& asset, const PictureOptions& options) {
    ReadyScene scene;
    scene.scene.assets.push_back({asset.about["name"].get<std::string>(), asset.file.path(), -1, {}});
    scene.scene.instances.emplace_back();
    scene.scene.shadows = options.shadows;
    scene.scene.environment = options.environment;
    scene.assets.push_back(asset);
    scene.instances.push_back(Instance{});
    std::vector<uint32_t> first_material;
    scene.materials = gather_materials(scene.assets, &first_material);
    scene.bounds = asset.bounds();
    scene.camera = default_camera_path(scene.bounds.centre, scene.bounds.radius);
    return scene;
}

}  // namespace

Result<Picture> draw_picture(const Asset& asset, const PictureOptions& options, const Progress& progress) {
    const auto debug = debug_named("debug", options.debug);
    if (!debug) return tl::unexpected(debug.error());
    if (auto known = check_backend("backend", options.backend); !known) return tl::unexpected(known.error());
    if (auto known = check_raster("raster", options.raster, options.backend); !known)
        return tl::unexpected(known.error());
    RendererOptions renderer_options;
    renderer_options.device = options.device;
    renderer_options.width = options.width;
    renderer_options.height = options.height;
    auto renderer = Renderer::create(renderer_options);
    if (!renderer) return tl::unexpected(renderer.error());
    ReadyScene scene = scene_of(asset, options);
    auto environment = environment_of(scene.scene);
    if (!environment) return tl::unexpected(environment.error());
    scene.materials.environment = std::move(*environment);
    auto session = DrawSession::open(scene, **renderer, {options.backend, options.order, options.raster},
                                     *debug == DebugView::misses, progress);
    if (!session) return tl::unexpected(session.error());
    (*session)->look.debug = *debug;
    Budget budget;
    budget.pixel_error = options.pixel_error;
    budget.forced_level = options.level;
    const Camera camera = options.camera ? *options.camera : usual_camera(scene);
    if (auto drawn = (*session)->settle(camera, budget, options.width, options.height); !drawn)
        return tl::unexpected(drawn.error());
    return (*renderer)->read_picture();
}

#else

Result<Picture> draw_picture(const Asset&, const PictureOptions&, const Progress&) {
    return fail(Fault::machine, "render: this build was made without Vulkan; configure with -DLODESTONE_RENDER=ON");
}

#endif

}  // namespace lodestone
