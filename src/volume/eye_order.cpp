#include "volume/eye_order.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace lodestone::volume {

std::vector<EyeOrdered> eye_order(const Lattice& lattice, const Bins& bins, const glm::vec3& eye) {
    const glm::dvec3 from = glm::dvec3(eye) / static_cast<double>(lattice.voxels);  // in metavoxels
    // Of equal cubes in a lattice the one that a ray meets first has the nearer middle: the eye is on its side of the
    // plane between the two.
    std::vector<double> distances;
    for (const Brick& brick : bins.bricks) {
        const glm::dvec3 away = glm::dvec3(brick.at) + 0.5 - from;
        distances.push_back(glm::dot(away, away));
    }
    std::vector<EyeOrdered> order;
    for (uint32_t layer = 0; layer < lattice.metavoxels.z; ++layer) {
        const bool under = layer > from.z;
        const auto begin = static_cast<std::ptrdiff_t>(order.size());
        for (uint32_t b = bins.first_brick[layer]; b < bins.first_brick[layer + 1]; ++b) order.push_back({b, under});
        std::stable_sort(order.begin() + begin, order.end(), [&](const EyeOrdered& a, const EyeOrdered& b) {
            return under ? distances[a.brick] < distances[b.brick] : distances[a.brick] > distances[b.brick];
        });
    }
    return order;
}

}  // namespace lodestone::volume
