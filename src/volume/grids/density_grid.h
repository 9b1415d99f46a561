// A sparse grid of densities, as simulations leave them: blocks of 8^3 values where there is something, and nothing in
// between. Values are kept in 16 bits as shares of the largest: none is off by more than 1/131070 of that.
//   Museth, "VDB: High-resolution sparse volumes with dynamic topology", TOG 2013, for leaves of 8^3 voxels.
#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "base/result.h"

namespace lodestone::volume {

// A value stands at whole numbers of voxel space; between them it is trilinear, and beyond the blocks it is 0.
struct DensityGrid {
    static constexpr uint32_t side = 8, per_block = side * side * side;
    static constexpr uint32_t no_block = 0xffffffff;

    glm::uvec3 blocks{0};          // of the box, in x, y and z, each at least 1
    std::vector<uint32_t> index;   // by z, y, x of the box, the last fastest: number of the block, or no_block
    std::vector<uint16_t> shares;  // of each block its values by z, y, x: 65535 times the share of `most`
    float most = 0;                // the largest value, > 0
    glm::uvec3 first{0}, last{0};  // the least box of voxels that are not 0, both in it
    glm::mat4 voxel_to_object{1};  // affine, can be inverted
    bool operator==(const DensityGrid&) const = default;

    uint64_t block_count() const { return shares.size() / per_block; }
    // Of a block of the box, each coordinate below `blocks`.
    uint32_t block_at(const glm::uvec3& at) const { return index[(size_t{at.z} * blocks.y + at.y) * blocks.x + at.x]; }
    // Share of the largest, 0 .. 1; any place of voxel space.
    float share_at(const glm::ivec3& voxel) const;
    // Trilinear; any place.
    float at(const glm::vec3& place) const;
    // Sets first and last from the values. Fault::format where all of them are 0.
    Result<void> find_extent();
    // Fault::invariant says what is wrong.
    Result<void> validate() const;
};

// How large grids may be that come from outside, and why no larger. A test can make each smaller.
struct GridLimits {
    // Voxels along a side: no lattice of volumes tells more from each other (64 metavoxels of 32 voxels).
    uint32_t side = 2048;
    // Blocks of 8^3 voxels that hold something: what a buffer takes that is bound at once on every device, 128 MiB.
    uint64_t blocks = 131072;
    // Bytes of a file. A file may have more grids than the one that is read.
    uint64_t file_bytes = uint64_t{1} << 36;
};

}  // namespace lodestone::volume
