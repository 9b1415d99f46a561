// Levels of an asset, whichever backend they are of.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "apps/scene/asset.h"
#include "base/progress.h"
#include "base/result.h"
#include "mesh/cache/vertex_cache.h"
#include "mesh/tri_mesh.h"
#include "vgi/extract/atlas_levels.h"

namespace lodestone {

// Level 0 is full detail: of an atlas the source, or the finest samples where it has no leaves. Shares what it tells of
// with the asset.
class Levels {
public:
    explicit Levels(std::shared_ptr<const ProgressiveMesh> lod);
    Levels(std::shared_ptr<const vgi::AtlasFile> atlas, vgi::AtlasLevels levels);

    uint32_t count() const;                            // at least 1
    uint64_t triangles(uint32_t level) const;          // level: below count()
    double error(uint32_t level) const;                // object units; level: below count()
    uint32_t for_triangles(uint64_t triangles) const;  // the finest level of at most so many; the last where none is
    uint32_t for_error(double error) const;            // the coarsest level within it; 0 where none is
    Result<void> check(uint32_t level) const;          // Fault::usage where it is none

private:
    std::shared_ptr<const ProgressiveMesh> lod_;  // one of the two
    std::shared_ptr<const vgi::AtlasFile> atlas_;
    std::optional<vgi::AtlasLevels> samples_;  // the atlas's
};

// backend: lod or vgi. Fault::format where the asset was baked without it.
Result<Levels> levels_of(const Asset& asset, const std::string& backend);

// A level as a mesh, faces in drawing order. order: of a progressive mesh, its first where empty. Fault::usage where
// level or order is none. Warns of textures that are baked into an atlas, which the mesh has not.
Result<TriMesh> extract(const Asset& asset, const std::string& backend, uint32_t level, const std::string& order = "",
                        const Progress& progress = {});

// An asset of the bytes of its file, which are copied.
Result<Asset> open_asset_in_memory(std::span<const std::byte> bytes);

// Chunk hashes, and whether the progressive mesh plays, pages decode and charts are glued. Fault::invariant or
// Fault::format.
Result<void> verify(const Asset& asset);

// What an index order costs a cache by name (cache_model_named). indices: three to a triangle. Fault::usage where
// there is no such cache, or they are not.
Result<CacheStatistics> simulated_cost(std::span<const uint32_t> indices, const std::string& cache);

}  // namespace lodestone
