// Rectangles side by side in squares. They may be turned and may become a little wider or narrower at the same area,
// so rows of similar heights fill a square but for the gutters.
//
//   Bederson, Shneiderman, Wattenberg, "Ordered and quantum treemaps", ACM Transactions on Graphics 21, 2002: strips
//   that fill the width; here strips are chosen by dynamic programming, so that shapes change least.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lodestone::vgi {

// What is to be packed: its shape, and the area wanted, in units of any size.
struct WantedRectangle {
    double width = 1, height = 1;  // > 0
};

// Where it lies.
struct PackedRectangle {
    uint32_t square = 0;
    bool turned = false;           // by a quarter, counter-clockwise
    double x = 0, y = 0;           // the lowest corner, 0 .. 1 of the square
    double width = 0, height = 0;  // as it lies there; > 0
};

// gutter: at least so far apart from others, and half as far from the square's sides; in units of the square's side,
// below 1. Areas in a square are in the ratios wanted, but for the gutters' rounding. squares: at least 1; rectangles
// go to them in the order given, about the same area to each; some get none where there are fewer rectangles. None
// where gutters alone take more than a square.
std::optional<std::vector<PackedRectangle>> pack(std::span<const WantedRectangle> wanted, uint32_t squares,
                                                 double gutter);

}  // namespace lodestone::vgi
