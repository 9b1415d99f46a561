#include "vgi/bake/images/corners/corner_saturation.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "vgi/asset/leaves/leaf_demands.h"
#include "vgi/asset/saturation.h"

namespace lodestone::vgi {

CornerSaturation::CornerSaturation(const Atlas& atlas, std::span<const uint32_t> of,
                                   std::span<const glm::dvec3> positions)
    : positions_(positions),
      extent_(atlas.extent()),
      codes_(extent_),
      error_(positions.size(), 0),
      below_(positions.size()) {
    LeafDemands leaves;
    if (!atlas.leaves.empty()) leaves = LeafDemands(atlas, LeafNeighbours(atlas));
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const auto middle = static_cast<int32_t>(atlas.cells_of(c) / 2);
        const size_t centre = texel_of(atlas, c, {middle, middle});
        const Leaf asked = atlas.leaves.empty() ? Leaf{} : leaves.of_chart(atlas, c);
        for (uint32_t k = 0; k < 4; ++k) {
            // A centre moves to its place from where its corners are in theirs (saturation.h).
            add(of[4 * c + k], atlas.sample_errors[centre], error_ratio, atlas.sample_radii[centre],
                atlas.point(centre));
            add(of[4 * c + k], asked.error, 1, asked.radius, atlas.lattice_point(asked.position));
        }
    }
}

std::vector<uint8_t> CornerSaturation::codes(std::span<const uint32_t> order, std::span<const CornerFate> fates) const {
    std::vector<uint8_t> codes;
    double before = 0;
    for (const uint32_t v : order) {
        before = std::min(std::max({before, fates[v].error * (1 + rounding), error_[v]}), extent_);
        codes.push_back(codes_.of_error(before));
    }
    return codes;
}

void CornerSaturation::run(std::span<const uint32_t> order, std::span<const uint8_t> codes,
                           std::span<const CornerFate> fates, std::span<Corner> corners) {
    for (size_t i = 0; i < order.size(); ++i) {
        const uint32_t v = order[i];
        Corner& corner = corners[v];
        corner.error = codes[i];
        const auto error = static_cast<double>(codes_.error(corner.error));
        double radius = fates[v].radius;
        for (const Below& b : below_[v]) {
            const double away = glm::distance(b.at, positions_[v]);
            radius = std::max(radius, (b.error - error / b.ratio) * least_magnification + b.radius + away);
        }
        corner.radius = error > 0 ? codes_.of_radius(radius * (1 + rounding)) : uint8_t{0};
        add(fates[v].parent, corner.error, 1, corner.radius, positions_[v]);
    }
}

void CornerSaturation::add(uint32_t corner, uint8_t error, double ratio, uint8_t radius, const glm::dvec3& at) {
    const auto its = static_cast<double>(codes_.error(error));
    if (its == 0) return;
    error_[corner] = std::max(error_[corner], its * ratio);
    below_[corner].push_back({its, ratio, static_cast<double>(codes_.radius(radius)), at});
}

}  // namespace lodestone::vgi
