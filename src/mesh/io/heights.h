// Height maps as terrain: x to the east, y up, z to the south, one vertex per sample, holes where there is none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/tri_mesh.h"

namespace lodestone {

struct HeightMap {
    uint32_t width = 0, height = 0;       // samples
    std::vector<float> samples;           // rows north to south; a hole is not finite
    double spacing_x = 1, spacing_y = 1;  // object units from sample to sample
};

// A height that seems to stand for "no data" without the file saying so: the most frequent one, where it is a pit or a
// spike among what is around it.
struct VoidGuess {
    float height = 0;
    size_t samples = 0;        // of that height
    double times_farther = 0;  // from samples beside them than others from each other, in the mean
};
std::optional<VoidGuess> guess_voids(const HeightMap& map);

// Samples that hold no data take what their surroundings suggest, smoothly. Returns how many; 0 where there is nothing
// to go by.
size_t fill_voids(HeightMap& map);

// Triangles whose corners are all there; samples no triangle uses are left out. Texture coordinates span the whole map.
TriMesh terrain_of(const HeightMap& map);

}  // namespace lodestone
