// An asset file opened for use.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/files/chunk_file.h"
#include "base/json.h"
#include "baseline/discrete.h"
#include "frame/screen_error.h"
#include "lod/asset/progressive_mesh.h"
#include "mesh/io/material_chunks.h"
#include "vgi/asset/atlas_chunks.h"

namespace lodestone {

struct Asset {
    ChunkFile file;
    // Chunk "about": name, options, input, repair; what "lod/about" and "vgi/about" tell in "lod" and "vgi".
    Json about;
    std::shared_ptr<const ProgressiveMesh> lod;        // null where it was baked without
    std::shared_ptr<const DiscreteChain> discrete;     // null where it was baked without
    std::shared_ptr<const vgi::AtlasFile> atlas_file;  // null where it was baked without
    std::shared_ptr<const DiscreteChain> full;         // the source mesh alone; null where it was baked without
    MaterialChunks materials;                          // of chains, where there is neither of the two with their own

    // What `full` and `discrete` draw from, or make what they draw from.
    bool holds_mesh() const { return full != nullptr || holds_chain(); }
    bool holds_chain() const { return discrete != nullptr || lod != nullptr; }

    // Every page decoded; Fault::format where it was baked without, or is not what it should be.
    Result<vgi::Atlas> atlas() const;

    // Of whichever backend it was baked for; they agree.
    const std::vector<Material>& material_table() const;
    const std::vector<Image>& images() const;
    Sphere bounds() const;  // object space, around the source mesh: the same for all backends
};

// What whoever writes samples of an atlas with baked textures is told. path: of the asset.
std::string baked_textures_warning(const std::string& path);

// Of a file whose end is missing, opened as a prefix: the levels of the progressive mesh that are there, and what else
// is there whole. Every error names the file; Fault::format.
Result<Asset> open_asset(const std::filesystem::path& path, Extent extent = Extent::whole);
// The same of a file that is open.
Result<Asset> open_asset(ChunkFile file);

}  // namespace lodestone
