#include "apps/embed/levels.h"

#include <algorithm>
#include <vector>

#include "lod/asset/cursor.h"

namespace lodestone {

Levels::Levels(std::shared_ptr<const ProgressiveMesh> lod) : lod_(std::move(lod)) {}
Levels::Levels(std::shared_ptr<const vgi::AtlasFile> atlas, vgi::AtlasLevels levels)
    : atlas_(std::move(atlas)), samples_(std::move(levels)) {}

uint32_t Levels::count() const { return lod_ != nullptr ? lod_->levels() : samples_->levels(); }

uint64_t Levels::triangles(uint32_t level) const {
    return lod_ != nullptr ? lod_->triangles_at(level) : samples_->triangles_at(level);
}

double Levels::error(uint32_t level) const {
    return static_cast<double>(lod_ != nullptr ? lod_->errors[level] : samples_->error_at(level));
}

uint32_t Levels::for_triangles(uint64_t triangles) const {
    return lod_ != nullptr ? lod_->level_for_triangles(triangles) : samples_->level_for_triangles(triangles);
}

uint32_t Levels::for_error(double error) const {
    return lod_ != nullptr ? lod_->level_for_error(error) : samples_->level_for_error(error);
}

Result<void> Levels::check(uint32_t level) const {
    if (level < count()) return {};
    return fail(Fault::usage, "level " + std::to_string(level) + ": the asset has levels 0 (finest) to " +
                                  std::to_string(count() - 1));
}

Result<Levels> levels_of(const Asset& asset, const std::string& backend) {
    const std::string file = asset.file.path().string();
    if (backend != "lod" && backend != "vgi")
        return fail(Fault::usage, "backend " + backend + ": has no levels here; choose lod or vgi");
    if (backend == "lod") {
        if (asset.lod == nullptr)
            return fail(Fault::format, file + ": holds no progressive mesh; bake it with --backends lod");
        return Levels(asset.lod);
    }
    if (asset.atlas_file == nullptr) return fail(Fault::format, file + ": holds no atlas; bake it with --backends vgi");
    const auto errors = asset.file.array<float>("vgi/errors");
    if (!errors) return tl::unexpected(errors.error());
    if (errors->size() != asset.atlas_file->about().levels())
        return fail(Fault::format, file + ": chunk 'vgi/errors': is not one number per level; bake the asset again");
    const auto leaves = asset.atlas_file->leaf_triangles();
    if (!leaves) return tl::unexpected(leaves.error());
    return Levels(asset.atlas_file, {asset.atlas_file->about(), *errors, *leaves});
}

Result<TriMesh> extract(const Asset& asset, const std::string& backend, uint32_t level, const std::string& order,
                        const Progress& progress) {
    const auto levels = levels_of(asset, backend);
    if (!levels) return tl::unexpected(levels.error());
    if (auto good = levels->check(level); !good) return tl::unexpected(good.error());
    if (backend == "vgi") {
        if (!order.empty()) return fail(Fault::usage, "order " + order + ": is for the progressive mesh");
        auto atlas = asset.atlas();
        if (!atlas) return tl::unexpected(atlas.error());
        if (atlas->attributes.baked) progress.warning(baked_textures_warning(asset.file.path().string()));
        return vgi::extract_level(*atlas, vgi::levels_of(*atlas), level);
    }
    const ProgressiveMesh& pm = *asset.lod;
    const FaceOrder* found = order.empty() ? pm.orders.data() : pm.order_named(order);
    if (found == nullptr)
        return fail(Fault::usage, "order " + order + ": the asset does not hold it; bake it with --order " + order);
    auto mesh = extract_level(pm, level, static_cast<uint32_t>(found - pm.orders.data()));
    if (!mesh) return fail_at(asset.file.path().string(), mesh.error());
    return mesh;
}

Result<Asset> open_asset_in_memory(std::span<const std::byte> bytes) {
    const std::filesystem::path name = "asset in memory";
    auto file = ChunkFile::open(InputFile::of_memory(name, {bytes.begin(), bytes.end()}), name);
    if (!file) return tl::unexpected(file.error());
    return open_asset(std::move(*file));
}

Result<void> verify(const Asset& asset) {
    if (auto whole = asset.file.verify(); !whole) return whole;
    if (asset.lod != nullptr) {
        if (auto good = asset.lod->validate(); !good) return good;
    }
    if (asset.atlas_file != nullptr) {
        const auto atlas = asset.atlas();
        if (!atlas) return tl::unexpected(atlas.error());
        if (auto good = atlas->validate(); !good) return good;
    }
    return asset.discrete != nullptr ? asset.discrete->validate() : Result<void>{};
}

Result<CacheStatistics> simulated_cost(std::span<const uint32_t> indices, const std::string& cache) {
    const auto model = cache_model_named(cache);
    if (!model) return tl::unexpected(model.error());
    if (indices.size() % 3 != 0) return fail(Fault::usage, "indices are no whole number of triangles");
    return simulate(*model, indices);
}

}  // namespace lodestone
