// One picture of an asset, drawn off screen.
#pragma once

#include <optional>
#include <string>

#include "apps/scene/asset.h"
#include "apps/scene/scene.h"
#include "base/progress.h"
#include "base/result.h"
#include "frame/picture.h"
#include "frame/view.h"

namespace lodestone {

// What is drawn, and how.
struct PictureOptions {
    std::string backend = "lod", order, raster, device;  // empty: the usual one
    std::optional<Camera> camera;                        // everything in the frame unless given
    uint32_t width = 1280, height = 720;                 // pixels, 1 .. 16384
    double pixel_error = 1;                              // pixels, > 0
    int64_t level = -1;                                  // >= 0: this level whatever its error
    std::string debug = "none";                          // what is coloured, as --debug of `lodestone render`
    bool shadows = true;                                 // of the light
    std::string environment = no_environment;            // as Scene::environment
};

// Fault::machine where there is no Vulkan, in this build or on this machine.
Result<Picture> draw_picture(const Asset& asset, const PictureOptions& options, const Progress& progress);

}  // namespace lodestone
