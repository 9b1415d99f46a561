// Convex polygons cut in two.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace lodestone::tiles {

// The parts of a convex polygon where off(corner), which is linear in between, is at most 0, and at least 0. A part has
// fewer than three corners where there is nothing of it. between(a, b, share): the corner on the way from a to b.
template <class Corner, class Off, class Between>
std::array<std::vector<Corner>, 2> divided(const std::vector<Corner>& polygon, const Off& off, const Between& between) {
    std::array<std::vector<Corner>, 2> parts;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const Corner &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const double off_a = off(a), off_b = off(b);
        if (off_a <= 0) parts[0].push_back(a);
        if (off_a >= 0) parts[1].push_back(a);
        if (off_a * off_b >= 0) continue;
        const Corner middle = between(a, b, off_a / (off_a - off_b));
        parts[0].push_back(middle);
        parts[1].push_back(middle);
    }
    return parts;
}

}  // namespace lodestone::tiles
