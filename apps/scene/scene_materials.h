// The materials of all assets of a scene in one set, as renderers take it.
#pragma once

#include <cstdint>
#include <vector>

#include "apps/scene/asset.h"
#include "frame/materials.h"
#include "mesh/material.h"

namespace lodestone {

// first_material: becomes the number of each asset's first material in the set.
MaterialSet gather_materials(const std::vector<Asset>& assets, std::vector<uint32_t>* first_material);

// One mesh's; of no materials: one that is plain. Images no material looks up are left out.
void add_materials(const std::vector<Material>& table, const std::vector<Image>& images, MaterialSet& set);

}  // namespace lodestone
