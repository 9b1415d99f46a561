// The discrete cosine transform of blocks of 8 x 8 numbers, in integers: the same on every machine.
//
//   Ahmed, Natarajan, Rao, "Discrete cosine transform", 1974; the integers are those of ITU-T H.265, 8.6.4.2.
#pragma once

#include <array>
#include <cstdint>

namespace lodestone::vgi {

inline constexpr uint32_t block_side = 8;
using Block = std::array<int32_t, block_side * block_side>;  // row by row

// Coefficients of the orthonormal transform, 32768 to a unit. block: -2^15 .. 2^15.
std::array<int64_t, block_side * block_side> transformed(const Block& block);
// The numbers of coefficients, 16 to a unit, which are -largest_coefficient .. largest_coefficient; rounded.
Block untransformed(const Block& coefficients);
inline constexpr int32_t largest_coefficient = 65535;

}  // namespace lodestone::vgi
