// A scene made ready to draw: every asset baked (on first use, into the user's cache folder) and opened, materials
// gathered.
#pragma once

#include <memory>
#include <vector>

#include "apps/scene/asset.h"
#include "apps/scene/scene.h"
#include "base/progress.h"
#include "frame/frame_source.h"
#include "frame/materials.h"
#include "frame/screen_error.h"

namespace lodestone {

struct ReadyScene {
    Scene scene;
    std::vector<Asset> assets;  // as Scene::assets
    InstanceSet instances;      // as Scene::instances
    MaterialSet materials;
    Sphere bounds;                // world space, around all instances
    CameraPath camera;            // the scene's own or default_camera_path
    double bake_seconds = 0;      // spent now, 0 where every asset was in the cache
    uint64_t asset_bytes = 0;     // of the files
    uint32_t most_instances = 1;  // of one asset
    // Baked textures of vgi lie in blocks (vgi/draw/attributes/attribute_blocks.h).
    bool textures_in_blocks = false;
    bool whole = true;  // every asset has what was needed or welcome, and nothing of it was baked quickly
};

// Whether a part of an asset must be there, is taken where it is in the cache, or is left out.
enum class Need { no, welcome, must };
// What the backends to be opened draw from.
struct SceneNeeds {
    Need full = Need::must, discrete = Need::must, lod = Need::must;  // the mesh itself, chains, progressive meshes
    Need vgi = Need::no;                                              // atlases
    bool leaves = true;    // atlases have them; else finest samples denser than the source stand for it
    bool quickly = false;  // what is missing is baked so that it can be drawn soon; better is taken from the cache
};
// Bakes what is missing or stale, each part by itself. A named .lode is used as it is.
Result<ReadyScene> ready_scene(Scene scene, const SceneNeeds& needs, const Progress& progress);

// Where a picture is taken from unless told otherwise: half way along the scene's own path, else with everything in the
// frame.
Camera usual_camera(const ReadyScene& scene);

// $XDG_CACHE_HOME/lodestone or ~/.cache/lodestone.
std::filesystem::path cache_folder();

// One table for all assets; first_material[a] is where asset a's materials begin.
MaterialSet gather_materials(const std::vector<Asset>& assets, std::vector<uint32_t>* first_material);

}  // namespace lodestone
