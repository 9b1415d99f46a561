// Scenes: which assets stand where, how they are lit, how the camera flies. docs/scenes.md describes the JSON,
// docs/scene.schema.json is its schema.
#pragma once

#include <filesystem>
#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/scene/scene_volumes.h"
#include "base/files/chunk_file.h"
#include "base/result.h"
#include "frame/camera_path.h"
#include "frame/frame_source.h"
#include "mesh/clip.h"
#include "mesh/generate.h"
#include "mesh/io/read.h"

namespace lodestone {

// What budgets can be set to.
inline constexpr uint64_t most_mib = 1 << 20, most_triangles = uint64_t{1} << 40;

// As Scene::environment.
inline constexpr const char *built_in_sky = "sky", *no_environment = "none";

struct GeneratedSource {
    Shape shape = Shape::rock;
    std::string shape_name;
    uint64_t triangles = 0;
    uint64_t seed = 1;
};

struct SceneAsset {
    std::string name;
    std::filesystem::path file;  // a mesh or a .lode; empty where generated
    int gltf_mesh = -1;          // of a glTF file: that mesh alone
    std::optional<GeneratedSource> generated;
    bool is_lode() const { return file.extension() == ".lode"; }
};

struct SceneInstance {
    uint32_t asset = 0;  // into Scene::assets
    glm::mat4 object_to_world{1};
};

struct Scene {
    std::string name;
    std::vector<SceneAsset> assets;
    std::vector<SceneInstance> instances;
    std::optional<glm::vec3> light_direction;  // from the light towards the scene
    bool shadows = true;
    std::optional<CameraPath> camera;          // absent: chosen from the bounds of what stands there
    std::string environment = no_environment;  // light from all around: built_in_sky, or a .hdr file
    SceneVolumes volumes;                      // smoke and fire; none where it has no emitters
    Budget budget;                             // what frames may cost; of its members those that scenes can set
    bool allow_outside = false;                // as it was read: its meshes are read likewise
    ReadOptions heights;                       // how its height maps are read; other members count nothing
    std::vector<ClipPlane> clip;               // what they keep of meshes is baked; no asset that is named is cut
    Extent extent = Extent::whole;             // of named assets
};

// A scene file; a glTF file, whose meshes stand where its nodes put them; or a single mesh or asset, which then stands
// alone at the origin. Paths are relative to the file that names them, and lie in its folder unless allow_outside.
// Fault::format with file and place.
Result<Scene> read_scene(const std::filesystem::path& path, bool allow_outside = false);
Result<CameraPath> read_camera_path(const std::filesystem::path& path);

// A flight for a scene that brings none: from eight radii away to near the surface, a third of the way round.
CameraPath default_camera_path(const glm::vec3& centre, float radius);

}  // namespace lodestone
