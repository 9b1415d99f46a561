// Components too small for clusters of their own become quads as they are: a disk one, a sphere two, glued along all
// four sides. Scans come with thousands of such pieces, for each of which clusters would make nine or twelve charts.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

struct TemplateQuad {
    std::vector<uint32_t> triangles;    // of the surface
    std::array<uint32_t, 4> corners{};  // its vertices, counter-clockwise seen from outside
};

// triangles: of one component. None where it is not a disk whose boundary has four vertices at least.
std::optional<TemplateQuad> disk_template(const Surface& surface, std::span<const uint32_t> triangles);

// Of a closed component in four clusters, two and two become a quad: those that face two ways best. The diagonals of
// the two quads, from their first corner to their third, join different corners, so that both together are a
// tetrahedron at their coarsest. label: per triangle of the component, in their order. None where there are not four.
std::optional<std::array<TemplateQuad, 2>> sphere_template(const Surface& surface, std::span<const uint32_t> triangles,
                                                           std::span<const uint32_t> label);

}  // namespace lodestone::vgi
