// Assets of the C interface: baked, opened, their levels, and cuts.
#include <cstring>

#include "apps/c/handles.h"
#include "apps/embed/levels.h"
#include "apps/scene/asset.h"

using namespace lodestone;
using namespace lodestone::c;

namespace {

const char* name_of_backend(lodestone_backend backend) {
    return backend == LODESTONE_LOD ? "lod" : backend == LODESTONE_VGI ? "vgi" : nullptr;
}

// What is wrong with what most functions about levels are given; null where nothing is.
const char* fault_of(const lodestone_asset* asset, lodestone_backend backend) {
    if (asset == nullptr) return "asset is NULL";
    return name_of_backend(backend) == nullptr ? "backend must be LODESTONE_LOD or LODESTONE_VGI" : nullptr;
}

// The levels of a backend that the asset was baked with.
Result<Levels> levels_of_handle(const lodestone_asset* asset, lodestone_backend backend) {
    return levels_of(asset->asset, name_of_backend(backend));
}

}  // namespace

lodestone_status lodestone_bake(const lodestone_mesh* mesh, const char* options, const lodestone_progress* progress,
                                const char* path, lodestone_asset** asset) {
    if (asset != nullptr) *asset = nullptr;
    if (mesh == nullptr) return refused(__func__, "mesh is NULL");
    if (path == nullptr && asset == nullptr) return refused(__func__, "path and asset are both NULL");
    if (const char* fault = c::fault_of(progress)) return refused(__func__, fault);
    return status_of([&]() -> Result<void> {
        const auto words = bake_options_of_text(options == nullptr ? "" : options);
        if (!words) return tl::unexpected(words.error());
        std::atomic<bool> stop = false;
        std::optional<std::filesystem::path> out;
        if (path != nullptr) out = path;
        auto baked = bake_mesh(mesh->named, *words, out, asset != nullptr, progress_of(progress, stop));
        if (!baked) return tl::unexpected(baked.error());
        if (asset != nullptr) *asset = handle_of(std::move(*baked->asset));
        return {};
    });
}

lodestone_status lodestone_asset_open(const char* path, lodestone_asset** asset) {
    if (asset == nullptr) return refused(__func__, "asset is NULL");
    *asset = nullptr;
    if (path == nullptr) return refused(__func__, "path is NULL");
    return status_of([&]() -> Result<void> {
        auto opened = open_asset(std::filesystem::path(path));
        if (!opened) return tl::unexpected(opened.error());
        *asset = handle_of(std::move(*opened));
        return {};
    });
}

lodestone_status lodestone_asset_open_memory(const void* bytes, size_t size, lodestone_asset** asset) {
    if (asset == nullptr) return refused(__func__, "asset is NULL");
    *asset = nullptr;
    if (bytes == nullptr) return refused(__func__, "bytes is NULL");
    return status_of([&]() -> Result<void> {
        auto opened = open_asset_in_memory({static_cast<const std::byte*>(bytes), size});
        if (!opened) return tl::unexpected(opened.error());
        *asset = handle_of(std::move(*opened));
        return {};
    });
}

lodestone_status lodestone_asset_verify(const lodestone_asset* asset) {
    if (asset == nullptr) return refused(__func__, "asset is NULL");
    return status_of([&] { return verify(asset->asset); });
}

const char* lodestone_asset_about(const lodestone_asset* asset) {
    return asset == nullptr ? nullptr : asset->about.c_str();
}

lodestone_status lodestone_asset_bounds(const lodestone_asset* asset, float centre[3], float* radius) {
    if (asset == nullptr) return refused(__func__, "asset is NULL");
    if (centre == nullptr || radius == nullptr) return refused(__func__, "centre or radius is NULL");
    return status_of([&]() -> Result<void> {
        const Sphere bounds = asset->asset.bounds();
        for (int k = 0; k < 3; ++k) centre[k] = bounds.centre[k];
        *radius = bounds.radius;
        return {};
    });
}

lodestone_status lodestone_asset_materials(const lodestone_asset* asset, lodestone_arrays* arrays) {
    if (asset == nullptr) return refused(__func__, "asset is NULL");
    if (!is_sized(arrays)) return refused(__func__, "arrays is NULL, or its struct_size is not that of the struct");
    lodestone_arrays looks{};
    looks.material_count = static_cast<uint32_t>(asset->table.size());
    looks.image_count = static_cast<uint32_t>(asset->images.size());
    if (looks.material_count > 0) looks.material_table = asset->table.data();
    if (looks.image_count > 0) looks.images = asset->images.data();
    fill(arrays, looks);
    return LODESTONE_OK;
}

lodestone_status lodestone_asset_level_count(const lodestone_asset* asset, lodestone_backend backend,
                                             uint32_t* levels) {
    if (const char* fault = fault_of(asset, backend)) return refused(__func__, fault);
    if (levels == nullptr) return refused(__func__, "levels is NULL");
    return status_of([&]() -> Result<void> {
        const bool there = backend == LODESTONE_LOD ? asset->asset.lod != nullptr : asset->asset.atlas_file != nullptr;
        if (!there) {
            *levels = 0;
            return {};
        }
        const auto found = levels_of_handle(asset, backend);
        if (!found) return tl::unexpected(found.error());
        *levels = found->count();
        return {};
    });
}

lodestone_status lodestone_asset_level(const lodestone_asset* asset, lodestone_backend backend, uint32_t level,
                                       uint64_t* triangles, double* error) {
    if (const char* fault = fault_of(asset, backend)) return refused(__func__, fault);
    return status_of([&]() -> Result<void> {
        const auto levels = levels_of_handle(asset, backend);
        if (!levels) return tl::unexpected(levels.error());
        if (auto good = levels->check(level); !good) return fail_at("lodestone_asset_level", good.error());
        if (triangles != nullptr) *triangles = levels->triangles(level);
        if (error != nullptr) *error = levels->error(level);
        return {};
    });
}

lodestone_status lodestone_asset_level_for_triangles(const lodestone_asset* asset, lodestone_backend backend,
                                                     uint64_t triangles, uint32_t* level) {
    if (const char* fault = fault_of(asset, backend)) return refused(__func__, fault);
    if (level == nullptr) return refused(__func__, "level is NULL");
    return status_of([&]() -> Result<void> {
        const auto levels = levels_of_handle(asset, backend);
        if (!levels) return tl::unexpected(levels.error());
        *level = levels->for_triangles(triangles);
        return {};
    });
}

lodestone_status lodestone_asset_level_for_error(const lodestone_asset* asset, lodestone_backend backend, double error,
                                                 uint32_t* level) {
    if (const char* fault = fault_of(asset, backend)) return refused(__func__, fault);
    if (level == nullptr) return refused(__func__, "level is NULL");
    if (!(error >= 0)) return refused(__func__, "error must be 0 or more");
    return status_of([&]() -> Result<void> {
        const auto levels = levels_of_handle(asset, backend);
        if (!levels) return tl::unexpected(levels.error());
        *level = levels->for_error(error);
        return {};
    });
}

lodestone_status lodestone_asset_extract(const lodestone_asset* asset, lodestone_backend backend, uint32_t level,
                                         lodestone_mesh** mesh) {
    if (mesh == nullptr) return refused(__func__, "mesh is NULL");
    *mesh = nullptr;
    if (const char* fault = fault_of(asset, backend)) return refused(__func__, fault);
    return status_of([&]() -> Result<void> {
        auto extracted = extract(asset->asset, name_of_backend(backend), level);
        if (!extracted) return fail_at("lodestone_asset_extract", extracted.error());
        *mesh = handle_of(NamedMesh{std::move(*extracted), asset->asset.about["name"].get<std::string>()});
        return {};
    });
}

void lodestone_asset_free(lodestone_asset* asset) { delete asset; }
