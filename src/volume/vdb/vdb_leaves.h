// What OpenVDB leaves of a grid for the process that asked: plain numbers, in memory that both see.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "volume/grids/density_grid.h"

namespace lodestone::volume {

struct VdbHead {
    uint64_t blocks = 0;                // how many follow
    double voxel_to_object[4][4] = {};  // columns; of OpenVDB's indices
    int32_t low[3] = {}, high[3] = {};  // least and largest block, in blocks of its indices
    float most = 0;                     // the largest value
};
struct VdbBlock {
    int32_t at[3] = {};  // in blocks of OpenVDB's indices
    uint32_t padding = 0;
    uint16_t shares[DensityGrid::per_block] = {};  // by z, y, x
};

// What the module lodestone_vdb_reader.so is asked for, by the name lodestone_read_leaves: reads the grid into memory
// for a VdbHead and limits.blocks VdbBlocks, and says what is wrong, or nothing. Throws what OpenVDB throws.
using ReadLeaves = void(const std::filesystem::path& path, const std::string& name, const GridLimits& limits,
                        std::span<std::byte> memory, std::string& wrong);

}  // namespace lodestone::volume
