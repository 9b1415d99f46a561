// Height maps as terrain: x to the east, y up, z to the south, one vertex per sample, holes where there is none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/tri_mesh.h"

namespace lodestone {

struct HeightMap {
    uint32_t width = 0, height = 0;       // samples
    std::vector<float> samples;           // rows north to south; a hole is not finite
    double spacing_x = 1, spacing_y = 1;  // object units from sample to sample
};

// Samples that hold no data take what their surroundings suggest, smoothly. Returns how many; 0 where there is nothing
// to go by.
size_t fill_voids(HeightMap& map);

// Triangles whose corners are all there; samples no triangle uses are left out. Texture coordinates span the whole map.
TriMesh terrain_of(const HeightMap& map);

}  // namespace lodestone
