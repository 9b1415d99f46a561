// An atlas in an asset file: a description, the gluing, and compressed pages.
#pragma once

#include "base/chunk_file.h"
#include "base/result.h"
#include "vgi/atlas.h"

namespace lodestone::vgi {

// Chunks vgi/atlas, vgi/sides, vgi/clusters, vgi/errors, vgi/bounds, vgi/geometry_ends, vgi/geometry_pages,
// vgi/attribute_ends, vgi/attribute_pages, and the materials.
Result<void> write_chunks(const Atlas& atlas, ChunkWriter& writer);
// Decodes every page. Errors name file and chunk; Fault::format.
Result<Atlas> open_atlas(const ChunkFile& file);

}  // namespace lodestone::vgi
