#include "vgi/asset/codec/block_transform.h"

#include <cstddef>

namespace lodestone::vgi {

namespace {

// Row k: the kth cosine. The squares of a row sum up to 2^15, about.
constexpr int32_t cosines[block_side][block_side] = {
    {64, 64, 64, 64, 64, 64, 64, 64},     {89, 75, 50, 18, -18, -50, -75, -89}, {83, 36, -36, -83, -83, -36, 36, 83},
    {75, -18, -89, -50, 50, 89, 18, -75}, {64, -64, -64, 64, 64, -64, -64, 64}, {50, -89, 18, 75, -75, -18, 89, -50},
    {36, -83, 83, -36, -36, 83, -83, 36}, {18, -50, 75, -89, 89, -75, 50, -18}};

}  // namespace

std::array<int64_t, block_side * block_side> transformed(const Block& block) {
    std::array<int64_t, block_side * block_side> across{}, both{};
    for (size_t y = 0; y < block_side; ++y) {
        for (size_t k = 0; k < block_side; ++k) {
            for (size_t x = 0; x < block_side; ++x)
                across[y * block_side + k] += int64_t{cosines[k][x]} * block[y * block_side + x];
        }
    }
    for (size_t k = 0; k < block_side; ++k) {
        for (size_t y = 0; y < block_side; ++y) {
            for (size_t x = 0; x < block_side; ++x)
                both[k * block_side + x] += cosines[k][y] * across[y * block_side + x];
        }
    }
    return both;
}

Block untransformed(const Block& coefficients) {
    constexpr int32_t first_shift = 7, second_shift = 15 + 4 - first_shift;  // below 2^31 in between
    Block down{}, numbers{};
    for (size_t k = 0; k < block_side; ++k) {
        for (size_t x = 0; x < block_side; ++x) {
            const int32_t coefficient = coefficients[k * block_side + x];
            if (coefficient == 0) continue;
            for (size_t y = 0; y < block_side; ++y) down[y * block_side + x] += cosines[k][y] * coefficient;
        }
    }
    for (int32_t& number : down) number = (number + (1 << (first_shift - 1))) >> first_shift;
    for (size_t y = 0; y < block_side; ++y) {
        for (size_t k = 0; k < block_side; ++k) {
            const int32_t coefficient = down[y * block_side + k];
            if (coefficient == 0) continue;
            for (size_t x = 0; x < block_side; ++x) numbers[y * block_side + x] += cosines[k][x] * coefficient;
        }
    }
    for (int32_t& number : numbers) number = (number + (1 << (second_shift - 1))) >> second_shift;
    return numbers;
}

}  // namespace lodestone::vgi
