// Levels of an atlas as meshes.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/tri_mesh.h"
#include "vgi/asset/atlas.h"
#include "vgi/extract/chart_places.h"

namespace lodestone::vgi {

// What is made of an atlas, and the wedges of it that are samples.
struct ExtractedMesh {
    TriMesh mesh;                 // without textures, but for the atlas's own
    std::vector<bool> is_sample;  // per wedge; a leaf's are not
};

// A level of samples: glued samples are one vertex; wedges where attributes differ. Diagonals alternate.
// level: 0 (finest) .. atlas.levels() - 1. places: of textures that hold what is baked into the atlas; wedges have
// their coordinates then, and no colours.
TriMesh extract_samples(const Atlas& atlas, uint32_t level, const ChartPlaces* places = nullptr);

// The source surface: what glued leaves share is one vertex; squares without a leaf are as their finest samples have
// them. Decodes all leaves, which must be good (open_atlas). places: likewise.
ExtractedMesh extract_source(const Atlas& atlas, const ChartPlaces* places);
TriMesh extract_leaves(const Atlas& atlas);  // the same, without places

}  // namespace lodestone::vgi
