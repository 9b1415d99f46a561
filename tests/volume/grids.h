// Density grids made of functions, for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "volume/grids/density_grid.h"

namespace lodestone::volume {

// Of size voxels from 0 on; value(voxel) >= 0, somewhere above.
template <class Value>
DensityGrid grid_of(const glm::uvec3& size, const glm::mat4& voxel_to_object, Value&& value) {
    DensityGrid grid;
    grid.voxel_to_object = voxel_to_object;
    grid.blocks = (size + DensityGrid::side - 1u) / DensityGrid::side;
    const glm::uvec3 voxels = grid.blocks * DensityGrid::side;
    std::vector<float> dense;  // by z, y, x
    for (uint32_t i = 0; i < voxels.x * voxels.y * voxels.z; ++i) {
        const glm::uvec3 v(i % voxels.x, i / voxels.x % voxels.y, i / voxels.x / voxels.y);
        dense.push_back(v.x < size.x && v.y < size.y && v.z < size.z ? value(v) : 0.0f);
    }
    grid.most = std::ranges::max(dense);
    for (uint32_t b = 0; b < grid.blocks.x * grid.blocks.y * grid.blocks.z; ++b) {
        const glm::uvec3 at(b % grid.blocks.x, b / grid.blocks.x % grid.blocks.y, b / grid.blocks.x / grid.blocks.y);
        std::vector<uint16_t> shares;
        for (uint32_t k = 0; k < DensityGrid::per_block; ++k) {
            const glm::uvec3 v = at * 8u + glm::uvec3(k % 8, k / 8 % 8, k / 64);
            const float share = dense[(size_t{v.z} * voxels.y + v.y) * voxels.x + v.x] / grid.most;
            shares.push_back(static_cast<uint16_t>(std::lround(65535 * share)));
        }
        const bool any = std::ranges::any_of(shares, [](uint16_t s) { return s != 0; });
        grid.index.push_back(any ? static_cast<uint32_t>(grid.block_count()) : DensityGrid::no_block);
        if (any) grid.shares.insert(grid.shares.end(), shares.begin(), shares.end());
    }
    if (!grid.find_extent()) grid = {};
    return grid;
}

}  // namespace lodestone::volume
