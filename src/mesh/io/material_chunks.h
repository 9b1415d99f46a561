// Materials and textures in an asset file: one set for all backends.
#pragma once

#include <vector>

#include "base/files/chunk_file.h"
#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Chunks mesh/materials and mesh/image/N; nothing where they were written already.
Result<void> write_materials(ChunkWriter& writer, const std::vector<Material>& table, const std::vector<Image>& images);

// Errors name the file and the chunk; Fault::format.
struct MaterialChunks {
    std::vector<Material> table;
    std::vector<Image> images;
};
Result<MaterialChunks> read_materials(const ChunkFile& file);

}  // namespace lodestone
