#include "volume/grids/placed_grid.h"

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

namespace lodestone::volume {

namespace {

constexpr float slack = 0.01f;  // voxels, of the grid or the lattice: what rounding does

// Half sides of the box around a box of half sides `half` that is mapped by m.
glm::vec3 half_of_mapped(const glm::mat4& m, const glm::vec3& half) {
    return glm::abs(glm::vec3(m[0])) * half.x + glm::abs(glm::vec3(m[1])) * half.y + glm::abs(glm::vec3(m[2])) * half.z;
}

glm::vec3 mapped(const glm::mat4& m, const glm::vec3& place) { return glm::vec3(m * glm::vec4(place, 1)); }

}  // namespace

// A voxel is felt as far as the next ones. Blocks of voxels 8 b .. 8 b + 7 so reach from 8 b - 1 to 8 b + 8.
GridReach::GridReach(const PlacedGrid& placed, const Lattice& lattice)
    : grid_(placed.grid.get()),
      to_lattice_(lattice.world_to_lattice() * placed.voxel_to_world),
      low_(glm::vec3(grid_->first) - 1.0f - slack),
      high_(glm::vec3(grid_->last) + 1.0f + slack) {
    to_voxel_ = glm::inverse(to_lattice_);
    half_block_ = glm::vec3(0.5f * static_cast<float>(DensityGrid::side + 1) + slack);
    half_around_ = half_of_mapped(to_lattice_, half_block_) + slack;
}

bool GridReach::meets(const glm::vec3& low, const glm::vec3& high) const {
    const glm::vec3 middle = 0.5f * (low + high), half = 0.5f * (high - low);
    const glm::vec3 centre = mapped(to_voxel_, middle), reach = half_of_mapped(to_voxel_, half);
    const glm::vec3 from = glm::max(centre - reach, low_), to = glm::min(centre + reach, high_);
    if (glm::any(glm::greaterThan(from, to))) return false;
    const auto side = static_cast<float>(DensityGrid::side);
    const glm::ivec3 most(glm::ivec3(grid_->blocks) - 1);
    const glm::ivec3 begin = glm::clamp(glm::ivec3(glm::floor((from - slack - side) / side)), glm::ivec3(0), most);
    const glm::ivec3 end = glm::clamp(glm::ivec3(glm::floor((to + slack + 1.0f) / side)), glm::ivec3(0), most);
    for (int z = begin.z; z <= end.z; ++z) {
        for (int y = begin.y; y <= end.y; ++y) {
            for (int x = begin.x; x <= end.x; ++x) {
                if (grid_->block_at(glm::uvec3(x, y, z)) == DensityGrid::no_block) continue;
                const glm::vec3 block = side * glm::vec3(x, y, z) + 0.5f * (side - 1.0f);
                // Along the faces of the block, and along those of the box.
                if (glm::any(glm::greaterThan(glm::abs(block - centre), reach + half_block_))) continue;
                const glm::vec3 away = glm::abs(mapped(to_lattice_, block) - middle);
                if (!glm::any(glm::greaterThan(away, half + half_around_))) return true;
            }
        }
    }
    return false;
}

}  // namespace lodestone::volume
