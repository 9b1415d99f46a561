#include "apps/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <optional>
#include <set>

#include "apps/scene/scene_node.h"
#include "apps/scene/scene_volumes.h"
#include "base/files/file.h"
#include "base/json.h"
#include "base/random.h"
#include "base/text.h"
#include "mesh/io/read.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

Result<Json> parse_file(const fs::path& path) {
    const uint64_t most_bytes = Limits{}.scene_bytes;
    auto bytes = read_file(path, most_bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    if (bytes->bytes.size() > most_bytes)
        return fail(Fault::format, path.string() + ": " + over_limit("bytes", bytes->bytes.size(), most_bytes));
    const auto* text = reinterpret_cast<const char*>(bytes->bytes.data());
    Result<Json> json;
    try {
        json = Json::parse(text, text + bytes->bytes.size(), nullptr, true, true);
    } catch (const Json::parse_error& e) {
        json = fail(Fault::format,
                    path.string() + ": byte " + std::to_string(e.byte) + ": is not JSON; see docs/scenes.md");
    } catch (const Json::out_of_range&) {
        json = fail(Fault::format, path.string() + ": has a number that is too large; see docs/scenes.md");
    }
    if (auto whole = bytes->intact(); !whole) return tl::unexpected(whole.error());
    return json;
}

Result<CameraPath> camera_from(const Node& node) {
    CameraPath path;
    if (auto done = only_members(
            node, {"lodestone", "version", "keys", "up", "fov_y_degrees", "near", "far", "frames", "comment"});
        !done) {
        return tl::unexpected(done.error());
    }
    float degrees = 45;
    uint64_t frames = path.frames;
    auto done =
        all([&] { return vector(node, "up", path.up); }, [&] { return number(node, "fov_y_degrees", degrees, 1, 170); },
            [&] { return number(node, "near", path.near_plane, 1e-9f, 1e9f); },
            [&] { return number(node, "far", path.far_plane, 1e-9f, 1e12f); },
            [&] { return whole(node, "frames", frames, 1, 100000); });
    if (!done) return tl::unexpected(done.error());
    if (path.far_plane <= path.near_plane) return node.wrong("far must be larger than near");
    path.fov_y = glm::radians(degrees);
    path.frames = static_cast<uint32_t>(frames);
    const auto keys = node.json.find("keys");
    if (keys == node.json.end() || !keys->is_array() || keys->empty())
        return node.wrong("keys must be an array of at least one {eye, target}");
    for (size_t i = 0; i < keys->size(); ++i) {
        const Node key{(*keys)[i], node.place + ".keys[" + std::to_string(i) + "]"};
        if (auto known = only_members(key, {"eye", "target"}); !known) return tl::unexpected(known.error());
        CameraKey k;
        done =
            all([&] { return vector(key, "eye", k.eye, true); }, [&] { return vector(key, "target", k.target, true); });
        if (!done) return tl::unexpected(done.error());
        path.keys.push_back(k);
    }
    return path;
}

Result<SceneAsset> asset_from(const Node& node, const Beside& beside) {
    if (auto done = only_members(node, {"name", "file", "generate"}); !done) return tl::unexpected(done.error());
    SceneAsset asset;
    std::string file;
    if (auto done = all([&] { return text(node, "name", asset.name); }, [&] { return text(node, "file", file); });
        !done) {
        return tl::unexpected(done.error());
    }
    const auto generate = node.json.find("generate");
    if (file.empty() == (generate == node.json.end())) return node.wrong("needs either file or generate");
    if (asset.name.empty()) return node.wrong("needs a name");
    if (!file.empty()) {
        auto path = path_named_by(beside.scene, file, beside.allow_outside);
        if (!path) return tl::unexpected(path.error());
        asset.file = *path;
        return asset;
    }
    const Node recipe{*generate, node.place + ".generate"};
    if (auto done = only_members(recipe, {"shape", "triangles", "seed"}); !done) return tl::unexpected(done.error());
    GeneratedSource source;
    source.triangles = 100000;
    auto done = all([&] { return text(recipe, "shape", source.shape_name); },
                    [&] { return whole(recipe, "triangles", source.triangles, 1, uint64_t{1} << 31); },
                    [&] { return whole(recipe, "seed", source.seed, 0, ~uint64_t{0}); });
    if (!done) return tl::unexpected(done.error());
    auto shape = shape_named(source.shape_name);
    if (!shape) return recipe.wrong(shape.error().message);
    source.shape = *shape;
    asset.generated = source;
    return asset;
}

Result<uint32_t> asset_named(const Node& node, const std::string& name, const std::vector<SceneAsset>& assets) {
    const auto at = std::ranges::find(assets, name, &SceneAsset::name);
    if (at == assets.end()) return node.wrong("there is no asset named '" + name + "'");
    return static_cast<uint32_t>(at - assets.begin());
}

// Adds many instances, one in each cell of a grid.
Result<void> scatter(const Node& node, const std::vector<SceneAsset>& assets, std::vector<SceneInstance>& instances) {
    if (auto done = only_members(node, {"assets", "count", "area", "scale", "seed"}); !done) return done;
    uint64_t count = 0, seed = 1;
    glm::vec2 area(1), scale(1);
    auto done = all([&] { return whole(node, "count", count, 1, 100000); },
                    [&] { return whole(node, "seed", seed, 0, ~uint64_t{0}); },
                    [&] { return pair(node, "area", area, true); }, [&] { return pair(node, "scale", scale, false); });
    if (!done) return done;
    if (count == 0) return node.wrong("count is missing");
    const auto names = node.json.find("assets");
    if (names == node.json.end() || !names->is_array() || names->empty())
        return node.wrong("assets must be an array of names");
    std::vector<uint32_t> chosen;
    for (const Json& name : *names) {
        auto asset = asset_named(node, name.is_string() ? name.get<std::string>() : "", assets);
        if (!asset) return tl::unexpected(asset.error());
        chosen.push_back(*asset);
    }
    const ScatteredPlaces places(count, area);
    Random random(mix64(seed));
    for (uint64_t i = 0; i < count; ++i) {
        const glm::vec3 place = places.place(i, random);
        const auto angle = static_cast<float>(random.unit() * 6.283185307179586);
        const float size = scale.x * std::pow(scale.y / scale.x, static_cast<float>(random.unit()));
        SceneInstance instance;
        instance.asset = chosen[i % chosen.size()];
        instance.object_to_world = glm::translate(glm::mat4(1), place);
        instance.object_to_world = glm::rotate(instance.object_to_world, angle, glm::vec3(0, 1, 0));
        instance.object_to_world = glm::scale(instance.object_to_world, glm::vec3(size));
        instances.push_back(instance);
    }
    return {};
}

Result<SceneInstance> instance_from(const Node& node, const std::vector<SceneAsset>& assets) {
    if (auto done = only_members(node, {"asset", "position", "axis", "angle_degrees", "scale"}); !done)
        return tl::unexpected(done.error());
    std::string name;
    glm::vec3 position(0), axis(0, 1, 0);
    float angle = 0, scale = 1;
    auto done = all([&] { return text(node, "asset", name); }, [&] { return vector(node, "position", position); },
                    [&] { return vector(node, "axis", axis); },
                    [&] { return number(node, "angle_degrees", angle, -36000, 36000); },
                    [&] { return number(node, "scale", scale, 1e-6f, 1e6f); });
    if (!done) return tl::unexpected(done.error());
    const auto asset = asset_named(node, name, assets);
    if (!asset) return tl::unexpected(asset.error());
    SceneInstance instance;
    instance.asset = *asset;
    if (glm::length(axis) == 0) return node.wrong("axis must not be zero");
    instance.object_to_world = glm::translate(glm::mat4(1), position);
    if (angle != 0) instance.object_to_world = glm::rotate(instance.object_to_world, glm::radians(angle), axis);
    instance.object_to_world = glm::scale(instance.object_to_world, glm::vec3(scale));
    return instance;
}

Node member(const Node& root, const char* name, size_t i) {
    return {root.json[name][i], root.place + ": " + name + "[" + std::to_string(i) + "]"};
}

Result<void> read_assets(const Node& root, const Beside& beside, Scene& scene) {
    const auto assets = root.json.find("assets");
    if (assets == root.json.end() || !assets->is_array() || assets->empty())
        return root.wrong("assets must be an array of at least one");
    for (size_t i = 0; i < assets->size(); ++i) {
        auto asset = asset_from(member(root, "assets", i), beside);
        if (!asset) return tl::unexpected(asset.error());
        scene.assets.push_back(std::move(*asset));
    }
    return {};
}

// What is placed one by one and what is scattered; with neither, every asset stands at the origin.
Result<void> read_instances(const Node& root, Scene& scene) {
    const auto instances = root.json.find("instances"), scattered = root.json.find("scatter");
    if (instances == root.json.end() && scattered == root.json.end()) {
        for (uint32_t a = 0; a < scene.assets.size(); ++a) scene.instances.push_back({a, glm::mat4(1)});
    }
    if (instances != root.json.end()) {
        if (!instances->is_array()) return root.wrong("instances must be an array");
        for (size_t i = 0; i < instances->size(); ++i) {
            auto instance = instance_from(member(root, "instances", i), scene.assets);
            if (!instance) return tl::unexpected(instance.error());
            scene.instances.push_back(*instance);
        }
    }
    if (scattered != root.json.end()) {
        if (!scattered->is_array()) return root.wrong("scatter must be an array");
        for (size_t i = 0; i < scattered->size(); ++i) {
            if (auto good = scatter(member(root, "scatter", i), scene.assets, scene.instances); !good) return good;
        }
    }
    return {};
}

Result<void> read_light(const Node& node, Scene& scene) {
    const Json& light = node.json;
    const bool directed = light.is_object() && light.contains("direction");
    glm::vec3 direction(0);
    const auto shadows = light.is_object() ? light.find("shadows") : light.end();
    auto done = all(
        [&] {
            return only_members(node, {"direction", "shadows"});
        },
        [&] { return vector(node, "direction", direction, false); });
    if (!done) return done;
    if (directed && glm::length(direction) == 0) return node.wrong("direction must not be zero");
    if (shadows != light.end() && !shadows->is_boolean()) return node.wrong("shadows must be true or false");
    if (directed) scene.light_direction = direction;
    scene.shadows = shadows == light.end() || shadows->get<bool>();
    return {};
}

Result<void> read_head(const Node& root, Scene& scene) {
    if (auto done = only_members(
            root, {"lodestone", "version", "comment", "assets", "instances", "scatter", "light", "camera",
                   "environment", "resident_mib", "upload_mib", "max_triangles", "volumes", "volume_options"});
        !done) {
        return done;
    }
    if (root.json.value("lodestone", Json()) != Json("scene"))
        return root.wrong("lodestone must be \"scene\"; see docs/scenes.md");
    uint64_t version = 0, resident_mib = 1024, upload_mib = 0;
    Budget& budget = scene.budget;
    auto done = all([&] { return whole(root, "version", version, 0, 1000); },
                    [&] { return whole(root, "resident_mib", resident_mib, 1, most_mib); },
                    [&] { return whole(root, "upload_mib", upload_mib, 1, most_mib); },
                    [&] { return whole(root, "max_triangles", budget.max_triangles, 1, most_triangles); });
    if (!done) return done;
    if (version != 1) return root.wrong("version must be 1; this program reads no other");
    budget.resident_bytes = resident_mib << 20;
    if (root.json.contains("upload_mib")) budget.upload_bytes = upload_mib << 20;
    return {};
}

Result<void> read_environment(const Node& root, const Beside& beside, Scene& scene) {
    if (auto done = text(root, "environment", scene.environment); !done) return done;
    if (scene.environment == no_environment || scene.environment == built_in_sky) return {};
    auto path = path_named_by(beside.scene, scene.environment, beside.allow_outside);
    if (!path) return tl::unexpected(path.error());
    scene.environment = path->string();
    return {};
}

Result<CameraPath> read_named_path(const Beside& beside, const std::string& name) {
    auto path = path_named_by(beside.scene, name, beside.allow_outside);
    return path ? read_camera_path(*path) : tl::unexpected(path.error());
}

Result<Scene> scene_from(const Node& root, const fs::path& path, bool allow_outside) {
    const Beside beside{path, allow_outside};
    Scene scene;
    scene.allow_outside = allow_outside;
    scene.name = as_utf8(path.stem().stem().string());
    if (auto done = read_head(root, scene); !done) return tl::unexpected(done.error());
    if (auto done = read_assets(root, beside, scene); !done) return tl::unexpected(done.error());
    if (auto done = read_instances(root, scene); !done) return tl::unexpected(done.error());
    if (const auto light = root.json.find("light"); light != root.json.end()) {
        if (auto done = read_light({*light, root.place + ": light"}, scene); !done) return tl::unexpected(done.error());
    }
    if (auto done = read_environment(root, beside, scene); !done) return tl::unexpected(done.error());
    if (auto done = read_volumes(root, beside, scene.volumes); !done) return tl::unexpected(done.error());
    if (const auto camera = root.json.find("camera"); camera != root.json.end()) {
        auto read = camera->is_string() ? read_named_path(beside, camera->get<std::string>())
                                        : camera_from({*camera, root.place + ": camera"});
        if (!read) return tl::unexpected(read.error());
        scene.camera = *read;
    }
    return scene;
}

}  // namespace

Result<CameraPath> read_camera_path(const fs::path& path) {
    auto json = parse_file(path);
    if (!json) return tl::unexpected(json.error());
    return camera_from({*json, path.string()});
}

namespace {

bool is_gltf(fs::path path) {
    if (path.extension() == ".gz") path = path.stem();
    return path.extension() == ".gltf" || path.extension() == ".glb";
}

// An asset per mesh. Nothing where one mesh stands there once, or there are so many that each by itself would be too
// little to simplify: then the file is one mesh.
std::optional<Scene> scene_of(const std::vector<PlacedMesh>& placed, const fs::path& path) {
    constexpr size_t most_meshes = 64;
    Scene scene;
    scene.name = as_utf8(path.stem().string());
    std::map<uint32_t, uint32_t> asset_of;
    for (const PlacedMesh& one : placed) {
        const auto [at, fresh] = asset_of.try_emplace(one.mesh, static_cast<uint32_t>(scene.assets.size()));
        if (fresh) {
            SceneAsset asset;
            asset.name = scene.name + "-mesh" + std::to_string(one.mesh);
            asset.file = path;
            asset.gltf_mesh = static_cast<int>(one.mesh);
            scene.assets.push_back(std::move(asset));
        }
        scene.instances.push_back({at->second, one.to_scene});
    }
    if (placed.size() < 2 || scene.assets.size() > most_meshes) return std::nullopt;
    return scene;
}

}  // namespace

Result<Scene> read_scene(const fs::path& path, bool allow_outside) {
    if (path.extension() == ".json") {
        auto json = parse_file(path);
        if (!json) return tl::unexpected(json.error());
        return scene_from({*json, path.string()}, path, allow_outside);
    }
    Scene scene;
    scene.allow_outside = allow_outside;
    scene.name = as_utf8(path.stem().string());
    if (is_gltf(path)) {
        ReadOptions options;
        options.allow_outside = allow_outside;
        auto placed = read_gltf_nodes(path, options);
        if (!placed) return tl::unexpected(placed.error());
        if (auto several = scene_of(*placed, path)) {
            several->allow_outside = allow_outside;
            return std::move(*several);
        }
    }
    SceneAsset asset;
    asset.name = scene.name;
    asset.file = path;
    scene.assets.push_back(std::move(asset));
    scene.instances.push_back({});
    return scene;
}

CameraPath default_camera_path(const glm::vec3& centre, float radius) {
    CameraPath path;
    const float r = radius > 0 ? radius : 1;
    const auto eye = [&](float distance, float degrees) {
        const float a = glm::radians(degrees);
        return centre + r * distance * glm::vec3(std::sin(a) * 0.92f, 0.39f, std::cos(a) * 0.92f);
    };
    path.keys = {{eye(8, 0), centre}, {eye(4, 40), centre}, {eye(2.2f, 80), centre}, {eye(1.5f, 120), centre}};
    path.near_plane = r * 0.005f;
    path.far_plane = r * 40;
    return path;
}

}  // namespace lodestone
