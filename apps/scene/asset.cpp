#include "apps/scene/asset.h"

#include <algorithm>

#include "vgi/asset/atlas_chunks.h"

namespace lodestone {

Result<Asset> open_asset(const std::filesystem::path& path) {
    auto file = ChunkFile::open(path);
    if (!file) return tl::unexpected(file.error());
    Asset asset{std::move(*file), {}, nullptr, nullptr, nullptr};
    auto about = asset.file.text("about");
    if (!about) return tl::unexpected(about.error());
    asset.about = nlohmann::json::parse(*about, nullptr, false);
    const auto wrong = [&](const char* what) {
        return fail(Fault::format, path.string() + ": chunk 'about': " + what + "; bake the asset again");
    };
    if (asset.about.is_discarded()) return wrong("is not JSON");
    const auto bounds = asset.about.find("bounds");
    if (bounds == asset.about.end() || !bounds->is_array() || bounds->size() != 4 ||
        !std::ranges::all_of(*bounds, [](const auto& n) { return n.is_number(); }))
        return wrong("has no bounds");
    if (asset.file.contains("lod/mesh")) {
        auto lod = ProgressiveMesh::open(asset.file);
        if (!lod) return tl::unexpected(lod.error());
        asset.lod = std::make_shared<const ProgressiveMesh>(std::move(*lod));
    }
    if (asset.file.contains("discrete/levels")) {
        auto chain = DiscreteChain::open(asset.file);
        if (!chain) return tl::unexpected(chain.error());
        asset.discrete = std::make_shared<const DiscreteChain>(std::move(*chain));
    }
    if (asset.file.contains("vgi/atlas")) {
        auto atlas = vgi::AtlasFile::open(asset.file);
        if (!atlas) return tl::unexpected(atlas.error());
        asset.atlas_file = std::make_shared<const vgi::AtlasFile>(std::move(*atlas));
    }
    return asset;
}

Result<vgi::Atlas> Asset::atlas() const {
    if (atlas_file == nullptr)
        return fail(Fault::format, file.path().string() + ": holds no atlas; bake it with --backends vgi");
    return vgi::open_atlas(file);
}

const std::vector<Material>& Asset::material_table() const {
    return lod != nullptr ? lod->material_table : atlas_file->about().material_table;
}
Sphere Asset::bounds() const {
    const auto& b = about["bounds"];
    return {{b[0].get<float>(), b[1].get<float>(), b[2].get<float>()}, b[3].get<float>()};
}
const std::vector<Image>& Asset::images() const { return lod != nullptr ? lod->images : atlas_file->about().images; }

}  // namespace lodestone
