// The rule by which an atlas is cut, and what errors and radii of samples keep for its sake.
//
// A sample m with error E and radius r is wanted from an eye e iff E * Q + r > |m - e|, Q being focal length over pixel
// error: everything within r of m is then far enough for E to stay below the pixel error. Errors and radii are
// saturated: wherever a sample is wanted, so are its parents in the bintree, for every eye and every Q of at least
// least_magnification. A cut is therefore conforming with no look at neighbours, and samples glued together carry the
// same numbers, so it is across charts too.
// What leaves ask of samples is told apart from that: leaf_demands.h.
#pragma once

#include "base/result.h"
#include "vgi/asset/atlas.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// A parent's error is at least this many times its child's, one step of the code: a sample that appears can move to its
// place while the wanted error falls by that factor, and is there before the next one appears. 2^(1/8).
inline constexpr double error_ratio = 1.0905077326652577;
// Radii may be smaller the larger the smallest Q that is used: at 720 lines and 60 degrees, errors up to 10 pixels.
inline constexpr double least_magnification = 64;

// The bintree of a chart's own samples, and where one of them is among all texels.
inline Bintree bintree_of(const Atlas& atlas, uint32_t chart) { return {static_cast<int32_t>(atlas.cells_of(chart))}; }
inline size_t texel_of(const Atlas& atlas, uint32_t chart, GridPoint p) {
    return atlas.texel(chart, static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y));
}

// Texels of a page that its parent has not.
template <class Visit>
void for_own_samples(const Atlas& atlas, uint32_t chart, uint32_t page, Visit&& visit) {
    const PageTree tree = tree_of(atlas, Layer::geometry, chart);
    uint32_t level = 0, px = 0, py = 0;
    tree.place(page, &level, &px, &py);
    const uint32_t n = tree.cells_per_page();
    for (uint32_t y = py * n; y <= py * n + n; ++y) {
        for (uint32_t x = px * n; x <= px * n + n; ++x) {
            if (page == 0 || x % 2 == 1 || y % 2 == 1) visit(atlas.texel(chart, x << level, y << level));
        }
    }
}

// Glued samples share errors and radii; both are saturated; bounds hold what they say. Fault::invariant names the
// place.
Result<void> validate_errors(const Atlas& atlas);

}  // namespace lodestone::vgi
