#include "apps/scene/workplace.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string_view>

#include "apps/scene/bake.h"
#include "apps/terminal.h"
#include "base/check.h"
#include "base/clock.h"
#include "base/hash.h"
#include "frame/indexed_mesh.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

// Parts of assets are cached apart: whoever needs one does not wait for the others.
BakeOptions cache_options(const char* part, const SceneNeeds& needs, bool quickly, const ReadOptions& heights,
                          const std::vector<ClipPlane>& clip) {
    BakeOptions options;
    options.clip = clip;
    options.read.height_scale = heights.height_scale;
    options.read.pixel_size = heights.pixel_size;
    options.read.void_height = heights.void_height;
    options.read.fill_voids = heights.fill_voids;
    options.backends = {part};
    options.atlas.bake_textures = false;  // it takes as long again; all parts look textures up alike
    options.atlas.error_samples = 20000;  // they only say how far off it is
    options.orders = {"keyframe", "greedy", "static", "classic"};
    if (!needs.leaves) {
        options.atlas.leaves = false;
        options.atlas.samples_per_triangle = 8;
    }
    if (quickly) {
        options.orders = {"static"};
        options.error_samples = 20000;
    }
    return options;
}

// Where an asset comes from that is baked on first use.
struct AssetSource {
    std::string name;
    Hash128 hash;
    ReadOptions heights;          // Scene::heights
    std::vector<ClipPlane> clip;  // Scene::clip
    std::function<Result<BakeInput>(const BakeOptions&)> make;
};

// Takes parts of one asset from the cache, or bakes them into it.
class PartBakery {
public:
    PartBakery(const AssetSource& source, const SceneNeeds& needs, const Progress& progress)
        : source_(source), needs_(needs), progress_(progress) {}

    double seconds = 0;  // spent on baking
    bool whole = true;   // as ReadyScene has it

    // Nothing where the part is welcome, and not in the cache.
    Result<std::optional<Asset>> part(const char* name, Need need) {
        // Only progressive meshes have a quick bake.
        const bool quickly = needs_.quickly && std::string_view(name) == "lod";
        if (auto found = in_cache(name, false)) return found;
        whole = whole && !quickly && need == Need::must;
        if (quickly) {
            if (auto found = in_cache(name, true)) return found;
        }
        if (need != Need::must) return std::optional<Asset>();
        auto baked = bake(name, quickly);
        if (!baked) return tl::unexpected(baked.error());
        return std::optional(std::move(*baked));
    }

private:
    fs::path path_of(const BakeOptions& options) const {
        const Hash128 key = bake_key(source_.hash, options);
        return cache_folder() / (source_.name + "-" + key.hex().substr(0, 16) + ".lode");
    }
    std::optional<Asset> in_cache(const char* name, bool quickly) const {
        const fs::path path = path_of(cache_options(name, needs_, quickly, source_.heights, source_.clip));
        std::error_code error;
        if (!fs::exists(path, error)) return std::nullopt;
        auto asset = open_asset(path);
        if (asset) return std::move(*asset);
        progress_.warning(asset.error().message + " (baking it anew)");
        return std::nullopt;
    }
    Result<Asset> bake(const char* name, bool quickly) {
        const BakeOptions options = cache_options(name, needs_, quickly, source_.heights, source_.clip);
        const fs::path path = path_of(options), folder = cache_folder();
        std::error_code error;
        fs::create_directories(folder, error);
        if (error) {
            return fail(Fault::machine,
                        folder.string() + ": cannot be made: " + error.message() + "; set XDG_CACHE_HOME");
        }
        note("baking " + source_.name + " for " + name + (quickly ? ", quickly," : "") + " into " + path.string());
        const Stopwatch watch;
        auto input = source_.make(options);
        if (!input) return tl::unexpected(input.error());
        auto report = bake_asset(std::move(*input), options, path, progress_);
        if (!report) return tl::unexpected(report.error());
        seconds += watch.wall();
        return open_asset(path);
    }

    const AssetSource& source_;
    const SceneNeeds needs_;
    const Progress& progress_;
};

// Single meshes of a glTF file are told from the whole, and from each other.
Hash128 with_mesh(const Hash128& source, int gltf_mesh) {
    if (gltf_mesh < 0) return source;
    const std::string part = source.hex() + " mesh " + std::to_string(gltf_mesh);
    return hash_of(std::span<const char>(part));
}

// A named asset is used as it is; where its source lies beside it, and it or a file it refers to has changed, that is
// said.
Result<Asset> named_asset(const fs::path& path, Extent extent, const Progress& progress) {
    auto asset = open_asset(path, extent);
    if (!asset) return asset;
    const auto source = path_named_by(path, asset->about.value("name", ""));
    std::error_code error;
    if (!source || !fs::is_regular_file(*source, error)) return asset;
    ReadOptions options;
    const auto baked_with = asset->about.find("options");
    options.allow_outside = baked_with != asset->about.end() && baked_with->is_object() &&
                            baked_with->value("allow_outside", Json()) == Json(true);
    const auto now = hash_of_source(*source, options);
    if (now && !(*now == asset->file.provenance().source)) {
        progress.warning(path.string() + ": " + source->filename().string() +
                         " has changed since it was baked, or a file it refers to has; bake it again");
    }
    return asset;
}

Result<AssetSource> asset_source(const SceneAsset& asset, const Scene& scene, const Progress& progress) {
    AssetSource source;
    source.heights = scene.heights;
    source.clip = scene.clip;
    if (asset.generated) {
        const GeneratedSource& recipe = *asset.generated;
        source.name = recipe.shape_name + "-" + std::to_string(recipe.triangles) + "-" + std::to_string(recipe.seed);
        source.hash = hash_of(std::span<const char>(source.name));
        source.make = [&, name = source.name, hash = source.hash](const BakeOptions&) -> Result<BakeInput> {
            progress.at("generate " + name, 0);
            BakeInput input;
            input.mesh = generate(recipe.shape, recipe.triangles, recipe.seed);
            input.source = hash;
            input.name = name;
            return input;
        };
        return source;
    }
    ReadOptions read;
    read.allow_outside = scene.allow_outside;
    read.gltf_mesh = asset.gltf_mesh;
    const auto hash = hash_of_source(asset.file, read);
    if (!hash) return tl::unexpected(hash.error());
    source.hash = with_mesh(*hash, asset.gltf_mesh);
    source.name = asset.gltf_mesh >= 0 ? asset.name : asset.file.stem().string();
    source.make = [&, read, hash = *hash](BakeOptions options) -> Result<BakeInput> {
        options.read.allow_outside = read.allow_outside;
        options.read.gltf_mesh = read.gltf_mesh;
        auto input = read_bake_input(asset.file, options, progress);
        if (input && !(input->source == hash))
            return fail(Fault::format, asset.file.string() + ": was changed while it was read; try again");
        return input;
    };
    return source;
}

// A named asset draws what it holds.
Result<Asset> ready_named(const fs::path& file, Extent extent, const SceneNeeds& needs, const Progress& progress) {
    auto named = named_asset(file, extent, progress);
    if (!named) return named;
    const auto lacks = [&](const char* what, const char* backend) {
        return fail(Fault::format, file.string() + ": holds no " + what + "; bake it with --backends " + backend);
    };
    if (needs.lod == Need::must && named->lod == nullptr) return lacks("progressive mesh", "lod");
    if (needs.vgi == Need::must && named->atlas_file == nullptr) return lacks("atlas", "vgi");
    if (needs.discrete == Need::must && !named->holds_chain()) return lacks("chain of meshes", "discrete");
    if (needs.full == Need::must && !named->holds_mesh()) return lacks("mesh", "full");
    return named;
}

Result<Asset> ready_asset(const SceneAsset& asset, const SceneNeeds& needs, const Progress& progress,
                          ReadyScene& ready) {
    if (asset.is_lode()) {
        auto named = ready_named(asset.file, ready.scene.extent, needs, progress);
        if (named) ready.asset_bytes += named->file.file_bytes();
        return named;
    }
    const auto source = asset_source(asset, ready.scene, progress);
    if (!source) return tl::unexpected(source.error());
    PartBakery bakery(*source, needs, progress);
    std::optional<Asset> all;
    const auto add = [&](const char* name, Need need) -> Result<void> {
        if (need == Need::no) return {};
        auto part = bakery.part(name, need);
        if (!part) return tl::unexpected(part.error());
        if (!*part) return {};
        ready.asset_bytes += (*part)->file.file_bytes();
        if (!all) {
            all = std::move(**part);
            return {};
        }
        // All are drawn with the materials of one.
        if ((*part)->material_table().size() != all->material_table().size()) {
            return fail(Fault::format, (*part)->file.path().string() + ": has other materials than " +
                                           all->file.path().string() + "; remove both from the cache");
        }
        if ((*part)->lod != nullptr) all->lod = (*part)->lod;
        if ((*part)->discrete != nullptr) all->discrete = (*part)->discrete;
        if ((*part)->atlas_file != nullptr) all->atlas_file = (*part)->atlas_file;
        if ((*part)->full != nullptr) all->full = (*part)->full;
        return {};
    };
    auto done = add("lod", needs.lod);
    if (done) done = add("discrete", needs.discrete);
    if (done) done = add("vgi", needs.vgi);
    if (done && !(all && all->holds_mesh())) done = add("full", needs.full);
    ready.bake_seconds += bakery.seconds;
    ready.whole = ready.whole && bakery.whole;
    if (!done) return tl::unexpected(done.error());
    LODE_CHECK(all.has_value());
    return std::move(*all);
}

}  // namespace

Camera usual_camera(const ReadyScene& scene) {
    Camera camera = scene.camera.at(0.5);
    if (scene.scene.camera) return camera;
    constexpr float margin = 1.03f;
    const glm::vec3 towards = glm::normalize(camera.eye - camera.target);
    camera.target = scene.bounds.centre;
    camera.eye = camera.target + towards * (margin * scene.bounds.radius / std::sin(camera.fov_y / 2));
    return camera;
}

fs::path cache_folder() {
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != 0)
        return fs::path(cache) / "lodestone";
    const char* home = std::getenv("HOME");
    return (home != nullptr ? fs::path(home) / ".cache" : fs::temp_directory_path()) / "lodestone";
}

MaterialSet gather_materials(const std::vector<Asset>& assets, std::vector<uint32_t>* first_material) {
    MaterialSet set;
    first_material->clear();
    for (const Asset& asset : assets) {
        first_material->push_back(static_cast<uint32_t>(set.materials.size()));
        if (asset.material_table().empty()) {
            set.materials.emplace_back();
            continue;
        }
        const auto first_image = static_cast<int32_t>(set.images.size());
        set.images.insert(set.images.end(), asset.images().begin(), asset.images().end());
        for (Material material : asset.material_table()) {
            for (Texture* texture : material.textures()) {
                if (texture->there()) texture->image += first_image;
            }
            set.materials.push_back(std::move(material));
        }
    }
    return set;
}

Result<ReadyScene> ready_scene(Scene scene, const SceneNeeds& needs, const Progress& progress) {
    ReadyScene ready;
    ready.scene = std::move(scene);
    for (const SceneAsset& wanted : ready.scene.assets) {
        auto asset = ready_asset(wanted, needs, progress, ready);
        if (!asset) return tl::unexpected(asset.error());
        ready.assets.push_back(std::move(*asset));
    }
    std::vector<uint32_t> first_material;
    ready.materials = gather_materials(ready.assets, &first_material);
    std::vector<uint32_t> used(ready.assets.size(), 0);
    std::vector<Sphere> spheres;
    for (const Asset& asset : ready.assets) spheres.push_back(asset.bounds());
    glm::vec3 low(0), high(0);
    for (size_t i = 0; i < ready.scene.instances.size(); ++i) {
        const SceneInstance& instance = ready.scene.instances[i];
        ready.instances.push_back({instance.asset, first_material[instance.asset], instance.object_to_world});
        ready.materials.mirrors |= glm::determinant(glm::mat3(instance.object_to_world)) < 0;
        ready.most_instances = std::max(ready.most_instances, ++used[instance.asset]);
        const Sphere s = to_world(spheres[instance.asset], instance.object_to_world);
        low = i == 0 ? s.centre - s.radius : glm::min(low, s.centre - s.radius);
        high = i == 0 ? s.centre + s.radius : glm::max(high, s.centre + s.radius);
    }
    ready.bounds.centre = (low + high) * 0.5f;
    for (const Instance& instance : ready.instances) {
        const Sphere s = to_world(spheres[instance.asset], instance.object_to_world);
        ready.bounds.radius = std::max(ready.bounds.radius, glm::distance(s.centre, ready.bounds.centre) + s.radius);
    }
    ready.camera = ready.scene.camera.value_or(default_camera_path(ready.bounds.centre, ready.bounds.radius));
    return ready;
}

}  // namespace lodestone
