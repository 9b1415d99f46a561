#include "volume/lattice.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "base/check.h"

namespace lodestone::volume {

glm::mat4 Lattice::world_to_lattice() const {
    glm::mat4 m(turned);
    m[3] = glm::vec4(-corner, 1);
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 3; ++row) m[column][row] /= voxel;
    }
    return m;
}

glm::mat4 Lattice::lattice_to_world() const {
    const glm::mat3 back = glm::transpose(turned);
    glm::mat4 m(back * voxel);
    m[3] = glm::vec4(back * corner, 1);
    return m;
}

Lattice lattice_around(const std::vector<Emitter>& emitters, const glm::vec3& light, uint32_t across, uint32_t voxels) {
    LODE_CHECK(!emitters.empty() && across >= 1 && across <= most_metavoxels && voxels >= 8 && voxels <= 32, across,
               voxels);
    Lattice lattice;
    lattice.voxels = voxels;
    const glm::vec3 z = glm::normalize(light);
    const glm::vec3 aside = std::abs(z.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
    const glm::vec3 x = glm::normalize(glm::cross(aside, z));
    lattice.turned = glm::transpose(glm::mat3(x, glm::cross(z, x), z));
    Bounds all{glm::vec3(INFINITY), glm::vec3(-INFINITY)};
    for (const Emitter& emitter : emitters) {
        const Bounds bounds = bounds_of(emitter, lattice.turned);
        all.low = glm::min(all.low, bounds.low);
        all.high = glm::max(all.high, bounds.high);
    }
    // A voxel of nothing all around.
    const glm::vec3 size = all.high - all.low;
    const float longest = std::max(size.x, std::max(size.y, size.z));
    lattice.voxel = longest / static_cast<float>(across * voxels - 3);
    lattice.corner = all.low - 1.5f * lattice.voxel;
    const glm::vec3 samples = size / lattice.voxel + 2.99f;
    lattice.metavoxels = glm::clamp(glm::uvec3(glm::ceil(samples / static_cast<float>(voxels))), 1u, across);
    return lattice;
}

}  // namespace lodestone::volume
