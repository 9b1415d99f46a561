// What lodestone-vdb-reader leaves of a grid for the process that asked: a VdbHead and its VdbBlocks, in memory that
// both see.
#pragma once

#include <cstddef>
#include <cstdint>

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

}  // namespace lodestone::volume
