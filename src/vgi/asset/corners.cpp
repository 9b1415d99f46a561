#include "vgi/asset/corners.h"

#include <glm/geometric.hpp>
#include <string>

#include "base/structures/disjoint_sets.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/leaves/leaf_demands.h"
#include "vgi/asset/saturation.h"

namespace lodestone::vgi {

std::vector<uint32_t> glued_corners(const std::vector<GluedSide>& sides) {
    const auto count = static_cast<uint32_t>(sides.size());  // as many corners as sides
    DisjointSets one(count);
    const auto end_of = [](uint32_t chart, uint32_t side) { return chart * 4 + (side + 1) % 4; };
    for (uint32_t i = 0; i < count; ++i) {
        const GluedSide& other = sides[i];
        if (other.chart == ~0u) continue;
        one.join(i, end_of(other.chart, other.side));
        one.join(end_of(i / 4, i % 4), other.chart * 4 + other.side);
    }
    std::vector<uint32_t> number(count, ~0u), of(count);
    uint32_t next = 0;
    for (uint32_t i = 0; i < count; ++i) {
        uint32_t& its = number[one.find(i)];
        if (its == ~0u) its = next++;
        of[i] = its;
    }
    return of;
}

size_t corner_texel(const Atlas& atlas, uint32_t chart, uint32_t k) {
    const auto [x, y] = on_side(k, 0u, atlas.cells_of(chart));
    return atlas.texel(chart, x, y);
}

namespace {

tl::unexpected<Error> wrong(size_t corner, const char* what) {
    return fail(Fault::invariant, "corner " + std::to_string(corner) + " " + what);
}

// Each corner's parent stands before it, with a larger error, and not too far up.
Result<void> check_forest(const Atlas& atlas) {
    std::vector<uint32_t> depth(atlas.corners.size(), 0);
    for (size_t i = 0; i < atlas.corners.size(); ++i) {
        const Corner& corner = atlas.corners[i];
        if (i > 0 && corner.error > atlas.corners[i - 1].error)
            return wrong(i, "has a larger error than the one before");
        if (corner.parent == i) {
            if (i > 0 && atlas.corners[i - 1].parent != i - 1) return wrong(i, "is a root and stands behind others");
            continue;
        }
        if (corner.parent > i) return wrong(i, "stands before its parent");
        depth[i] = depth[corner.parent] + 1;
        if (depth[i] > most_corner_depth) return wrong(i, "has too many parents");
    }
    return {};
}

}  // namespace

Result<void> validate_corners(const Atlas& atlas) {
    if (atlas.corners.empty() && atlas.chart_corners.empty()) return {};
    const std::vector<uint32_t> glued = glued_corners(atlas.sides);
    if (atlas.chart_corners.size() * 4 != glued.size())
        return fail(Fault::invariant, "there are not four corners to a chart");
    std::vector<uint32_t> number(glued.size(), ~0u);  // by number among glued ones
    size_t used = 0;
    for (size_t i = 0; i < glued.size(); ++i) {
        const uint32_t own = atlas.chart_corners[i / 4][i % 4];
        if (own >= atlas.corners.size()) return wrong(own, "is not there");
        uint32_t& same = number[glued[i]];
        used += same == ~0u ? 1 : 0;
        if (same != ~0u && same != own) return wrong(own, "is glued to another");
        same = own;
    }
    if (used != atlas.corners.size()) return fail(Fault::invariant, "there are more corners than charts have");
    return check_forest(atlas);
}

Result<void> validate_corner_errors(const Atlas& atlas) {
    const ErrorCodes codes(atlas.extent());
    const auto point = [&](const Corner& c) {
        return atlas.origin + atlas.step * glm::dvec3(c.position[0], c.position[1], c.position[2]);
    };
    const auto covers = [&](const Corner& corner, uint8_t error, uint8_t radius, const glm::dvec3& at) {
        const auto its = static_cast<double>(codes.error(error)), own = static_cast<double>(codes.error(corner.error));
        const double reach = (its - own) * least_magnification + static_cast<double>(codes.radius(radius)) +
                             glm::length(at - point(corner));
        const bool is_within = reach <= static_cast<double>(codes.radius(corner.radius));
        return its == 0 || (its <= own && (is_within || corner.radius == ErrorCodes::everywhere));
    };
    const auto is_root = [&](size_t i) { return atlas.corners[i].parent == i; };
    for (size_t i = 0; i < atlas.corners.size(); ++i) {
        const Corner& corner = atlas.corners[i];
        if (!is_root(i) && !is_root(corner.parent) &&
            !covers(atlas.corners[corner.parent], corner.error, corner.radius, point(corner)))
            return wrong(i, "is not saturated into its parent");
    }
    LeafDemands leaves;
    if (!atlas.leaves.empty()) leaves = LeafDemands(atlas, LeafNeighbours(atlas));
    for (uint32_t c = 0; c < atlas.chart_corners.size(); ++c) {
        const Leaf asked = atlas.leaves.empty() ? Leaf{} : leaves.of_chart(atlas, c);
        const auto middle = static_cast<int32_t>(atlas.cells_of(c) / 2);
        const size_t centre = texel_of(atlas, c, {middle, middle});
        for (uint32_t k = 0; k < 4; ++k) {
            const uint32_t i = atlas.chart_corners[c][k];
            if (atlas.corners[i].position != atlas.positions[corner_texel(atlas, c, k)])
                return wrong(i, "lies elsewhere than its sample");
            if (!is_root(i) &&
                !covers(atlas.corners[i], atlas.sample_errors[centre], atlas.sample_radii[centre], atlas.point(centre)))
                return wrong(i, "is not saturated by its charts");
            if (!is_root(i) &&
                !covers(atlas.corners[i], asked.error, asked.radius, atlas.lattice_point(asked.position)))
                return wrong(i, "is not saturated by leaves");
        }
    }
    return {};
}

}  // namespace lodestone::vgi
