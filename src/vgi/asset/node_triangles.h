// The triangles of a grid of samples as they are drawn without a bintree: what cones of normals have to hold besides
// the bintree's own triangles.
#pragma once

#include <array>
#include <cstdint>

#include "vgi/asset/bintree.h"

namespace lodestone::vgi {

inline constexpr uint32_t most_node_shift = 3;  // log2 of a node's cells along a side

// Triangles of a node of n x n cells, n a power of two, in its own steps: on a border where the node across is coarser
// by so many levels, vertices go down to the next one that it has; what gets flat by that is left out. Diagonals run
// towards the middle, as tessellators lay them: no triangle has two border edges.
template <class Visit>
void for_node_triangles(int32_t n, const std::array<uint32_t, 4>& coarser, Visit&& visit) {
    const auto at = [&](int32_t x, int32_t y) {
        const auto collapsed = [](int32_t along, uint32_t levels) { return along >> levels << levels; };
        GridPoint p{x, y};
        if (y == 0) p.x = collapsed(x, coarser[0]);
        if (y == n) p.x = collapsed(x, coarser[2]);
        if (x == 0) p.y = collapsed(y, coarser[3]);
        if (x == n) p.y = collapsed(y, coarser[1]);
        return p;
    };
    const auto add = [&](GridPoint a, GridPoint b, GridPoint c) {
        if (!(a == b) && !(b == c) && !(c == a)) visit(a, b, c);
    };
    for (int32_t y = 0; y < n; ++y) {
        for (int32_t x = 0; x < n; ++x) {
            const GridPoint a = at(x, y), b = at(x + 1, y), c = at(x + 1, y + 1), d = at(x, y + 1);
            const bool rising = n > 1 && (2 * x < n) == (2 * y < n);
            if (rising) {
                add(a, b, c);
                add(a, c, d);
            } else {
                add(a, b, d);
                add(b, c, d);
            }
        }
    }
}

}  // namespace lodestone::vgi
