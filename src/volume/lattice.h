// The lattice that volumes are sampled on: a box of cubic metavoxels, each of the same number of voxels across, whose z
// axis is the direction of the light.
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "volume/particles.h"

namespace lodestone::volume {

// Samples stand at whole numbers of lattice space; metavoxel m spans m * voxels .. (m + 1) * voxels in each direction.
// So a metavoxel is its voxels and, as a halo, the first samples of the next ones: interpolation needs no more, and no
// length is counted twice.
struct Lattice {
    glm::mat3 turned{1};       // rows are its axes in world space; the last is where the light shines
    glm::vec3 corner{0};       // of the box, turned; world units
    float voxel = 1;           // world units from sample to sample
    uint32_t voxels = 32;      // across a metavoxel, 8 .. 32
    glm::uvec3 metavoxels{1};  // in x, y and z
    bool operator==(const Lattice&) const = default;

    glm::mat4 world_to_lattice() const;  // affine
    glm::mat4 lattice_to_world() const;
    uint32_t metavoxel_count() const { return metavoxels.x * metavoxels.y * metavoxels.z; }
    // Words of a metavoxel's samples with their halo.
    uint32_t brick_words() const { return (voxels + 1) * (voxels + 1) * (voxels + 1); }
};
inline constexpr uint32_t most_metavoxels = 64;  // across

// Around all that emitters (at least one) may send out at any time; the longest side has `across` metavoxels.
// light: from the light towards the scene, any length > 0.
Lattice lattice_around(const std::vector<Emitter>& emitters, const glm::vec3& light, uint32_t across, uint32_t voxels);

}  // namespace lodestone::volume
