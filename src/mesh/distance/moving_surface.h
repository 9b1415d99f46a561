// Closest points of triangles whose corners move, as those of a mesh that is being simplified.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "mesh/distance/distance.h"

namespace lodestone {

// A tree of boxes over the triangles. A triangle that moves makes the boxes above it larger, never smaller; when half
// of the triangles are gone, the tree is made anew.
class MovingSurface {
public:
    // positions: of all corners there will ever be; must outlive this. indices: three per triangle, at least one.
    MovingSurface(std::span<const glm::vec3> positions, std::span<const uint32_t> indices);

    // Corners of a triangle, as indices of positions.
    std::array<uint32_t, 3> corners(uint32_t triangle) const { return corners_[triangle]; }
    glm::dvec3 position(uint32_t triangle, uint32_t corner) const { return positions_[corners_[triangle][corner]]; }
    bool alive(uint32_t triangle) const { return leaf_[triangle] != nowhere; }

    void move(uint32_t triangle, const std::array<uint32_t, 3>& corners);
    // At least one triangle must be left.
    void remove(uint32_t triangle);

    // The point of one triangle that is nearest.
    ClosestSurface::Hit on(uint32_t triangle, const glm::dvec3& point) const;
    // As ClosestSurface::closest, of the triangles that are alive. hint: one of them or no_hint. near_enough: object
    // units.
    ClosestSurface::Hit closest(const glm::dvec3& point, uint32_t hint, double near_enough) const;

private:
    static constexpr uint32_t nowhere = ~0u, leaf_size = 4;
    struct Node {
        glm::vec3 low, high;
        uint32_t parent = nowhere;
        uint32_t first = 0;  // leaf: first place in order_; inner: the left child, the right one follows it
        uint32_t count = 0;  // leaf: triangles; 0 for inner nodes
    };
    void build();
    void split(uint32_t node, std::vector<uint32_t>& open, std::span<const glm::vec3> centres);
    void grow(uint32_t triangle);

    std::span<const glm::vec3> positions_;
    std::vector<std::array<uint32_t, 3>> corners_;
    std::vector<uint32_t> leaf_;  // by triangle; nowhere where it is gone
    std::vector<uint32_t> order_;
    std::vector<Node> nodes_;
    size_t alive_ = 0, built_ = 0;
};

}  // namespace lodestone
