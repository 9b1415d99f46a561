#include "apps/scene/backends.h"

#include <algorithm>

#include "baseline/discrete.h"
#include "baseline/fixed_levels.h"
#include "baseline/full.h"
#include "lod/asset/cursor.h"
#include "lod/draw/lod_source.h"
#include "lod/draw/morphed_vertex.h"
#include "vgi/draw/pulled_vertex.h"
#include "vgi/draw/vgi_source.h"
#include "vgi/study/patch_indices.h"

namespace lodestone {

namespace {

using Open = Result<std::unique_ptr<FrameSource>> (*)(const Technique& way, const ReadyScene& scene,
                                                      const Progress& progress);

// How vgi makes triangles, and whether of leaves, too.
struct VgiRaster {
    const char* name;
    vgi::Raster raster;
    bool draws_leaves;
};
constexpr VgiRaster vgi_rasters[] = {{"bintree", vgi::Raster::bintree, true},
                                     {"grid", vgi::Raster::grid, false},
                                     {"grid-area", vgi::Raster::grid_area, false},
                                     {"tess", vgi::Raster::tess, false},
                                     {"device", vgi::Raster::device, false}};
// And lod.
constexpr const char* lod_geomorph = "geomorph";

Result<std::unique_ptr<FrameSource>> open_full(const Technique&, const ReadyScene& scene, const Progress&) {
    std::vector<FixedLevels> levels;
    for (const Asset& asset : scene.assets) {
        const auto& chain = asset.full != nullptr ? asset.full : asset.discrete;
        levels.push_back(chain != nullptr
                             ? full_level(chain->vertices, chain->levels[0].indices, chain->further)
                             : full_level(asset.lod->vertices, asset.lod->orders[0].indices, asset.lod->further));
    }
    return open_fixed_levels(std::move(levels), scene.scene.budget.resident_bytes);
}

Result<std::unique_ptr<FrameSource>> open_discrete(const Technique&, const ReadyScene& scene,
                                                   const Progress& progress) {
    std::vector<FixedLevels> levels;
    for (const Asset& asset : scene.assets) {
        std::shared_ptr<const DiscreteChain> chain = asset.discrete;
        if (chain == nullptr) {
            // An asset baked without: the chain is made now from full detail.
            auto made = make_discrete_chain(mesh_of(PmCursor(*asset.lod)), progress);
            if (!made) return tl::unexpected(made.error());
            chain = std::make_shared<const DiscreteChain>(std::move(*made));
        }
        levels.push_back(fixed_levels_of(std::move(chain)));
    }
    return open_fixed_levels(std::move(levels), scene.scene.budget.resident_bytes);
}

Result<std::unique_ptr<FrameSource>> open_lod_scene(const Technique& way, const ReadyScene& scene, const Progress&) {
    std::vector<std::shared_ptr<const ProgressiveMesh>> assets;
    for (const Asset& asset : scene.assets) assets.push_back(asset.lod);
    return open_lod(assets, {.order = way.order,
                             .resident_bytes = scene.scene.budget.resident_bytes,
                             .instances = scene.most_instances,
                             .geomorph = way.raster == lod_geomorph});
}

Result<std::unique_ptr<FrameSource>> open_vgi_scene(const Technique& way, const ReadyScene& scene, const Progress&) {
    std::vector<std::shared_ptr<const vgi::AtlasFile>> assets;
    for (const Asset& asset : scene.assets) assets.push_back(asset.atlas_file);
    const auto* raster = std::ranges::find(vgi_rasters, way.raster, &VgiRaster::name);
    if (raster == std::end(vgi_rasters)) raster = vgi_rasters;
    return vgi::open_vgi(assets, {.resident_bytes = scene.scene.budget.resident_bytes,
                                  .instances = static_cast<uint32_t>(scene.instances.size()),
                                  .raster = raster->raster,
                                  .textures_in_blocks = scene.textures_in_blocks});
}

bool holds_chain(const Asset& asset) { return asset.holds_chain(); }
bool holds_mesh(const Asset& asset) { return asset.holds_mesh(); }
bool holds_progressive(const Asset& asset) { return asset.lod != nullptr; }
bool holds_atlas(const Asset& asset) { return asset.atlas_file != nullptr; }

struct Backend {
    const char* name;
    bool (*holds)(const Asset& asset);  // what it draws
    Open open;
    PlanMirror::Puller puller;         // of its vertices, where they are pulled
    std::vector<std::string> rasters;  // the first is drawn by unless told otherwise
};
const Backend backends[] = {{"full", holds_mesh, open_full, {}, {""}},
                            {"discrete", holds_chain, open_discrete, {}, {""}},
                            {"lod", holds_progressive, open_lod_scene, {morphed_vertex, {}}, {"", lod_geomorph}},
                            {"vgi", holds_atlas, open_vgi_scene, {vgi::pulled_vertex, vgi::patch_indices}, [] {
                                 std::vector<std::string> names;
                                 for (const VgiRaster& raster : vgi_rasters) names.emplace_back(raster.name);
                                 return names;
                             }()}};

const Backend* backend_named(const std::string& name) {
    for (const Backend& b : backends) {
        if (name == b.name) return &b;
    }
    return nullptr;
}

}  // namespace

SceneNeeds needs_of(const std::vector<std::string>& names, Need rest) {
    const auto need = [&](const char* name) {
        return std::ranges::find(names, name) != names.end() ? Need::must : rest;
    };
    return {need("full"), need("discrete"), need("lod"), need("vgi")};
}

void note_rasters(const std::vector<std::string>& rasters, SceneNeeds& needs) {
    for (const VgiRaster& raster : vgi_rasters) {
        if (!raster.draws_leaves && std::ranges::find(rasters, raster.name) != rasters.end()) needs.leaves = false;
    }
}

Result<void> check_backend(const std::string& option, const std::string& name) {
    if (backend_named(name) != nullptr) return {};
    std::string choices;
    for (const Backend& b : backends) choices += (choices.empty() ? "" : ", ") + std::string(b.name);
    return fail(Fault::usage, option + " " + name + ": there is no such backend; choose from " + choices);
}

std::vector<std::string> backend_names() {
    std::vector<std::string> names;
    for (const Backend& b : backends) names.emplace_back(b.name);
    return names;
}

Result<void> check_raster(const std::string& option, const std::string& name, const std::string& backend) {
    if (name.empty()) return {};
    std::string choices;
    for (const Backend& b : backends) {
        const bool asked = backend.empty() || backend == b.name;
        if (asked && std::ranges::find(b.rasters, name) != b.rasters.end()) return {};
        for (const std::string& raster : b.rasters) {
            if (raster.empty()) continue;
            choices += (choices.empty() ? "" : ", ") + raster + " (" + b.name + ")";
        }
    }
    return fail(Fault::usage, option + " " + name + ": there is no such way" +
                                  (backend.empty() ? "" : " to draw by " + backend) + "; there are " + choices);
}

std::vector<Technique> techniques_of(const std::string& backend, const ReadyScene& scene) {
    std::vector<std::string> orders{""};
    if (backend == "lod" && scene.assets[0].lod != nullptr) {
        orders.clear();
        for (const FaceOrder& o : scene.assets[0].lod->orders) {
            const bool everywhere = std::all_of(scene.assets.begin(), scene.assets.end(), [&](const Asset& a) {
                return a.lod != nullptr && a.lod->order_named(o.name) != nullptr;
            });
            if (everywhere) orders.push_back(o.name);
        }
    }
    std::vector<Technique> ways;
    for (const std::string& raster : backend_named(backend)->rasters) {
        for (const std::string& order : orders) ways.push_back({backend, order, raster});
    }
    return ways;
}

Result<std::unique_ptr<FrameSource>> open_backend(const Technique& way, const ReadyScene& scene,
                                                  const Progress& progress) {
    if (auto known = check_backend("--backend", way.backend); !known) return tl::unexpected(known.error());
    if (auto known = check_raster("--raster", way.raster, way.backend); !known) return tl::unexpected(known.error());
    const Backend& backend = *backend_named(way.backend);
    for (size_t a = 0; a < scene.assets.size(); ++a) {
        if (!backend.holds(scene.assets[a]))
            return fail(Fault::format, scene.scene.assets[a].name + ": is not baked for " + way.backend);
    }
    return backend.open(way, scene, progress);
}

PlanMirror::Puller puller_of(const std::string& backend) {
    const Backend* b = backend_named(backend);
    return b != nullptr ? b->puller : PlanMirror::Puller{};
}

}  // namespace lodestone
