// The binary triangle tree over a chart's samples: every sample but the four corners splits the one or two right
// triangles whose hypotenuse it halves. Levels alternate: a centre of a cell halves the cell's diagonal, the middles of
// the cell's edges halve the triangles that leaves. All samples together give the finest level of Atlas::extract.
//
//   Lindstrom, Koller, Ribarsky, Hodges, Faust, Turner, "Real-time, continuous level of detail rendering of height
//   fields", SIGGRAPH 1996; Duchaineau et al., "ROAMing terrain", IEEE Visualization 1997.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace lodestone::vgi {

struct GridPoint {
    int32_t x = 0, y = 0;
    bool operator==(const GridPoint&) const = default;
};

// cells: a power of two. A sample's level is that of the finest grid lines it lies on: stride 1 << level. Depths count
// from the finest: 2 level for middles of edges, 2 level + 1 for centres; depths() of them, without the corners.
struct Bintree {
    int32_t cells = 1;

    uint32_t depths() const { return 2 * static_cast<uint32_t>(std::bit_width(static_cast<uint32_t>(cells)) - 1); }
    bool contains(GridPoint p) const { return p.x >= 0 && p.y >= 0 && p.x <= cells && p.y <= cells; }
    bool is_corner(GridPoint p) const { return p.x % cells == 0 && p.y % cells == 0; }
    uint32_t level(GridPoint p) const {
        return static_cast<uint32_t>(std::countr_zero(static_cast<uint32_t>(p.x | p.y | cells)));
    }
    bool is_centre(GridPoint p) const {
        const int32_t h = 1 << level(p);
        return (p.x & h) != 0 && (p.y & h) != 0;
    }
    uint32_t depth(GridPoint p) const { return 2 * level(p) + (is_centre(p) ? 1 : 0); }

    // Ends of the hypotenuse that p halves; p is no corner.
    std::array<GridPoint, 2> hypotenuse(GridPoint p) const {
        const int32_t h = 1 << level(p);
        if (!is_centre(p)) {
            if ((p.x & h) != 0) return {GridPoint{p.x - h, p.y}, GridPoint{p.x + h, p.y}};
            return {GridPoint{p.x, p.y - h}, GridPoint{p.x, p.y + h}};
        }
        // Diagonals join the points whose grid coordinates have an even sum.
        if ((((p.x - h) / (2 * h) + (p.y - h) / (2 * h)) & 1) == 0)
            return {GridPoint{p.x - h, p.y - h}, GridPoint{p.x + h, p.y + h}};
        return {GridPoint{p.x - h, p.y + h}, GridPoint{p.x + h, p.y - h}};
    }
    // The right-angled corners of the triangles that p splits: two, or one on the chart's boundary. They are its
    // parents: p is there only where they are.
    template <class Visit>
    void for_parents(GridPoint p, Visit&& visit) const {
        const auto [a, b] = hypotenuse(p);
        // Across the hypotenuse: a quarter turn of its half around p.
        const GridPoint first{p.x - (b.y - p.y), p.y + (b.x - p.x)}, second{p.x + (b.y - p.y), p.y - (b.x - p.x)};
        if (contains(first)) visit(first);
        if (contains(second)) visit(second);
    }
    // Samples whose parent p is: up to four, none of the finest.
    template <class Visit>
    void for_children(GridPoint p, Visit&& visit) const {
        const int32_t h = 1 << level(p);
        const bool centre = is_centre(p);
        if (!centre && h == 1) return;
        const int32_t q = h / 2;
        const std::array<GridPoint, 4> around =
            centre ? std::array<GridPoint, 4>{GridPoint{p.x + h, p.y}, {p.x, p.y + h}, {p.x - h, p.y}, {p.x, p.y - h}}
                   : std::array<GridPoint, 4>{
                         GridPoint{p.x + q, p.y + q}, {p.x - q, p.y + q}, {p.x - q, p.y - q}, {p.x + q, p.y - q}};
        for (const GridPoint& c : around) {
            if (contains(c)) visit(c);
        }
    }
    // Every sample of a depth, row by row.
    template <class Visit>
    void for_depth(uint32_t depth, Visit&& visit) const {
        const int32_t h = 1 << (depth / 2);
        if (depth % 2 == 1) {
            for (int32_t y = h; y < cells; y += 2 * h) {
                for (int32_t x = h; x < cells; x += 2 * h) visit(GridPoint{x, y});
            }
            return;
        }
        for (int32_t y = 0; y <= cells; y += h) {
            for (int32_t x = (y & h) != 0 ? 0 : h; x <= cells; x += 2 * h) visit(GridPoint{x, y});
        }
    }
};

}  // namespace lodestone::vgi
