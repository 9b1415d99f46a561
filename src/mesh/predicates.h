// Signs that are right, whatever rounding does.
//   Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", Discrete &
//   Computational Geometry 18, 1997: sums and products as sums of doubles that do not overlap; exact where a bound on
//   the rounding does not tell.
#pragma once

#include <glm/vec2.hpp>

namespace lodestone {

// 1 where a, b, c are in counter-clockwise order, -1 where clockwise, 0 where they are on one line. Exact for finite
// coordinates whose products neither overflow nor underflow.
int orientation(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c);

}  // namespace lodestone
