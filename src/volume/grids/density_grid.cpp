#include "volume/grids/density_grid.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>
#include <string>

namespace lodestone::volume {

float DensityGrid::share_at(const glm::ivec3& voxel) const {
    const glm::ivec3 size(blocks * side);
    if (glm::any(glm::lessThan(voxel, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(voxel, size))) return 0;
    const glm::uvec3 v(voxel), in = v % side;
    const uint32_t block = block_at(v / side);
    if (block == no_block) return 0;
    return static_cast<float>(shares[size_t{block} * per_block + (in.z * side + in.y) * side + in.x]) / 65535;
}

float DensityGrid::at(const glm::vec3& place) const {
    // Far away all is 0, and whole numbers end.
    const glm::vec3 near = glm::clamp(place, glm::vec3(-2), static_cast<float>(side) * glm::vec3(blocks) + 2.0f);
    const glm::vec3 low = glm::floor(near), f = near - low;
    float sum = 0;
    for (int k = 0; k < 8; ++k) {
        const glm::ivec3 corner(k & 1, k >> 1 & 1, k >> 2);
        const glm::vec3 weight = glm::mix(1.0f - f, f, glm::vec3(corner));
        sum += weight.x * weight.y * weight.z * share_at(glm::ivec3(low) + corner);
    }
    return sum * most;
}

Result<void> DensityGrid::find_extent() {
    first = blocks * side;
    last = glm::uvec3(0);
    bool any = false;
    for (size_t b = 0; b < index.size(); ++b) {
        if (index[b] == no_block) continue;
        const glm::uvec3 at(b % blocks.x, b / blocks.x % blocks.y, b / blocks.x / blocks.y);
        for (uint32_t k = 0; k < per_block; ++k) {
            if (shares[size_t{index[b]} * per_block + k] == 0) continue;
            const glm::uvec3 voxel = at * side + glm::uvec3(k % side, k / side % side, k / side / side);
            first = glm::min(first, voxel);
            last = glm::max(last, voxel);
            any = true;
        }
    }
    return any ? Result<void>{} : fail(Fault::format, "holds nothing but 0");
}

Result<void> DensityGrid::validate() const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "density grid: " + what); };
    if (blocks.x == 0 || blocks.y == 0 || blocks.z == 0 || index.size() != uint64_t{blocks.x} * blocks.y * blocks.z)
        return wrong("box and index do not go together");
    if (shares.empty() || shares.size() % per_block != 0) return wrong("values that are no whole blocks");
    std::vector<uint8_t> named(block_count(), 0);
    for (const uint32_t block : index) {
        if (block == no_block) continue;
        if (block >= named.size() || named[block]++ != 0) return wrong("a block that is not there, or twice");
    }
    if (std::ranges::count(named, 0) != 0) return wrong("a block that is nowhere");
    if (!(most > 0) || !std::isfinite(most)) return wrong("the largest value is no number above 0");
    if (glm::any(glm::greaterThan(first, last)) || glm::any(glm::greaterThanEqual(last, blocks * side)))
        return wrong("voxels that are not 0 lie outside");
    const glm::mat4 back = glm::inverse(voxel_to_object);
    for (int k = 0; k < 16; ++k) {
        if (!std::isfinite(voxel_to_object[k / 4][k % 4]) || !std::isfinite(back[k / 4][k % 4]))
            return wrong("a map that cannot be inverted");
    }
    return {};
}

}  // namespace lodestone::volume
