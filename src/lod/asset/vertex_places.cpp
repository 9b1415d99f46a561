#include "lod/asset/vertex_places.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <numeric>

#include "base/check.h"

namespace lodestone {

namespace {

glm::vec3 position_of(const MeshVertex& v) { return {v.position[0], v.position[1], v.position[2]}; }

// The axis along which they reach farthest.
int longest_axis(std::span<const MeshVertex> vertices, std::span<const uint32_t> wedges) {
    glm::vec3 low = position_of(vertices[wedges[0]]), high = low;
    for (const uint32_t w : wedges) {
        low = glm::min(low, position_of(vertices[w]));
        high = glm::max(high, position_of(vertices[w]));
    }
    const glm::vec3 size = high - low;
    return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

// Brings the wedges of every region together, region after region: half of the regions below a plane, half above.
void cut_regions(std::span<const MeshVertex> vertices, std::span<uint32_t> wedges) {
    if (wedges.size() <= region_wedges) return;
    const size_t regions = (wedges.size() + region_wedges - 1) / region_wedges, below = regions / 2 * region_wedges;
    const int axis = longest_axis(vertices, wedges);
    std::ranges::nth_element(wedges, wedges.begin() + static_cast<ptrdiff_t>(below), [&](uint32_t a, uint32_t b) {
        const float at_a = vertices[a].position[axis], at_b = vertices[b].position[axis];
        return at_a != at_b ? at_a < at_b : a < b;
    });
    cut_regions(vertices, wedges.first(below));
    cut_regions(vertices, wedges.subspan(below));
}

// By wedge: which it is in the order in which faces first use them. Those that no face uses come last.
std::vector<uint32_t> first_uses(std::span<const uint32_t> indices, size_t wedges) {
    constexpr uint32_t none = ~0u;
    std::vector<uint32_t> uses(wedges, none);
    uint32_t next = 0;
    for (const uint32_t wedge : indices) {
        if (uses[wedge] == none) uses[wedge] = next++;
    }
    for (uint32_t& use : uses) {
        if (use == none) use = next++;
    }
    return uses;
}

}  // namespace

std::vector<uint32_t> vertex_places(const ProgressiveMesh& pm, uint32_t order) {
    LODE_CHECK(order < pm.orders.size(), order, pm.orders.size());
    const size_t wedges = pm.vertices.size();
    std::vector<uint32_t> by_place(wedges), places(wedges);
    std::iota(by_place.begin(), by_place.end(), 0);
    cut_regions(pm.vertices, by_place);
    const std::vector<uint32_t> uses = first_uses(pm.orders[order].indices, wedges);
    for (size_t begin = 0; begin < wedges; begin += region_wedges) {
        const auto region = std::span(by_place).subspan(begin, std::min<size_t>(region_wedges, wedges - begin));
        std::ranges::sort(region, {}, [&](uint32_t wedge) { return uses[wedge]; });
    }
    for (size_t place = 0; place < wedges; ++place) places[by_place[place]] = static_cast<uint32_t>(place);
    return places;
}

std::vector<uint32_t> placed(std::span<const uint32_t> wedges, std::span<const uint32_t> places) {
    std::vector<uint32_t> result(wedges.begin(), wedges.end());
    for (uint32_t& wedge : result) wedge = places[wedge];
    return result;
}

}  // namespace lodestone
