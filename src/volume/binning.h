// Which particles may reach which part of which metavoxel. Done on the CPU, in the order of particles, so that sums are
// the same in every run, and so that a plan knows how many bricks it needs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "volume/lattice.h"
#include "volume/particles.h"

namespace lodestone::volume {

// Metavoxels are divided into blocks of so many samples a side.
inline constexpr uint32_t block_side = 8;
// Across the light and along it: along it there may be one that holds nothing but the halo.
inline uint32_t blocks_across(uint32_t voxels) { return (voxels + block_side - 1) / block_side; }
inline uint32_t blocks_along(uint32_t voxels) { return voxels / block_side + 1; }
// Particles that a block takes; those after them are left out. A software rasteriser ends loops of a shader after 65535
// rounds, and a column of blocks takes nine a particle and block.
inline constexpr uint32_t most_in_block = 1024;

// A metavoxel that is not empty. Its samples lie in slot `number of the brick`.
struct Brick {
    glm::uvec3 at{0};         // which metavoxel
    uint32_t gap_before = 0;  // empty metavoxels towards the light, where it is the first of its column; else 0
    uint32_t gap_after = 0;   // empty metavoxels behind it until the next of the column, or its end
    bool first = false;       // of its column
    bool odd = false;         // the second, fourth and so on of its column
    uint64_t occupied = 0;    // bit (z * 4 + y) * 4 + x: something may be in that block
    bool operator==(const Brick&) const = default;
};

struct Bins {
    std::vector<Brick> bricks;          // by z, y, x: layer after layer as the light meets them
    std::vector<uint32_t> first_brick;  // of each layer, and one past the last; metavoxels.z + 1 numbers
    // Of each brick, by block (y, x, z, the last fastest): where its particles begin in `particles`, and how many.
    std::vector<uint32_t> first_particle, particle_count;
    std::vector<uint32_t> particles;  // numbers, rising in each block
    bool crowded = false;             // a block had more particles than it takes
    bool operator==(const Bins&) const = default;

    // Fault::invariant says what is wrong.
    Result<void> validate(const Lattice& lattice) const;
};

// How many metavoxels of the lattice are not empty.
uint32_t count_bricks(const Lattice& lattice, std::span<const Particle> particles);
Bins bin_particles(const Lattice& lattice, std::span<const Particle> particles);

}  // namespace lodestone::volume
