#include "apps/backends.h"

#include <algorithm>

#include "baseline/discrete.h"
#include "baseline/fixed_levels.h"
#include "baseline/full.h"
#include "lod/cursor.h"
#include "lod/lod_source.h"

namespace lodestone {

namespace {

using Open = Result<std::unique_ptr<FrameSource>> (*)(const std::string& order, const ReadyScene& scene,
                                                      const Progress& progress);

Result<std::unique_ptr<FrameSource>> open_full(const std::string&, const ReadyScene& scene, const Progress&) {
    std::vector<FixedLevels> levels;
    for (const Asset& asset : scene.assets)
        levels.push_back(full_level(asset.lod->vertices, asset.lod->orders[0].indices));
    return open_fixed_levels(std::move(levels), scene.scene.resident_bytes);
}

Result<std::unique_ptr<FrameSource>> open_discrete(const std::string&, const ReadyScene& scene,
                                                   const Progress& progress) {
    std::vector<FixedLevels> levels;
    for (const Asset& asset : scene.assets) {
        std::shared_ptr<const DiscreteChain> chain = asset.discrete;
        if (chain == nullptr) {
            // An asset baked without: the chain is made now from full detail.
            auto made = make_discrete_chain(extract_level(*asset.lod, 0), progress);
            if (!made) return tl::unexpected(made.error());
            chain = std::make_shared<const DiscreteChain>(std::move(*made));
        }
        levels.push_back(fixed_levels_of(std::move(chain)));
    }
    return open_fixed_levels(std::move(levels), scene.scene.resident_bytes);
}

Result<std::unique_ptr<FrameSource>> open_lod_scene(const std::string& order, const ReadyScene& scene,
                                                    const Progress&) {
    std::vector<std::shared_ptr<const ProgressiveMesh>> assets;
    for (const Asset& asset : scene.assets) assets.push_back(asset.lod);
    return open_lod(std::move(assets), {order, scene.scene.resident_bytes, scene.most_instances});
}

struct Backend {
    const char* name;
    Open open;
};
constexpr Backend backends[] = {{"full", open_full}, {"discrete", open_discrete}, {"lod", open_lod_scene}};

}  // namespace

std::vector<std::string> backend_names() {
    std::vector<std::string> names;
    for (const Backend& b : backends) names.emplace_back(b.name);
    return names;
}

std::vector<std::string> orders_of(const std::string& backend, const ReadyScene& scene) {
    if (backend != "lod") return {""};
    std::vector<std::string> orders;
    for (const FaceOrder& o : scene.assets[0].lod->orders) {
        const bool everywhere = std::all_of(scene.assets.begin(), scene.assets.end(),
                                            [&](const Asset& a) { return a.lod->order_named(o.name) != nullptr; });
        if (everywhere) orders.push_back(o.name);
    }
    return orders;
}

Result<std::unique_ptr<FrameSource>> open_backend(const std::string& backend, const std::string& order,
                                                  const ReadyScene& scene, const Progress& progress) {
    std::string choices;
    for (const Backend& b : backends) {
        if (backend == b.name) return b.open(order, scene, progress);
        choices += (choices.empty() ? "" : ", ") + std::string(b.name);
    }
    return fail(Fault::usage, "--backend " + backend + ": there is no such backend; choose from " + choices);
}

}  // namespace lodestone
