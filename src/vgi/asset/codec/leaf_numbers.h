// How numbers of a part of a leaf (leaf_codec.h) are coded, in both directions.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>

#include "base/files/range_coder.h"

namespace lodestone::vgi {

// What is learnt of whole numbers below 2^31 on both sides of 0: how many bits they have, and the highest but one.
class NumberModel {
public:
    template <class Coder>
    void code(Coder& coder, int32_t& number) {
        const auto size = static_cast<uint32_t>(std::abs(int64_t{number}));
        uint32_t node = 1;
        for (int32_t k = width_bits - 1; k >= 0; --k) {
            bool one = (static_cast<uint32_t>(std::bit_width(size)) >> k & 1) != 0;
            coder.bit(width_[node], one);
            node = node << 1 | (one ? 1u : 0u);
        }
        const uint32_t width = node - (1u << width_bits);
        if (width == 0) {
            number = 0;
            return;
        }
        bool below = number < 0;
        coder.even_bit(below);
        uint32_t decoded = 1, rest = width - 1;
        if (rest > 0) {
            bool one = (size >> --rest & 1) != 0;
            coder.bit(second_[width], one);
            decoded = decoded << 1 | (one ? 1u : 0u);
        }
        while (rest > 0) {
            const uint32_t count = std::min(rest, most_even_bits);
            rest -= count;
            uint32_t bits = size >> rest & ((1u << count) - 1);
            coder.even_bits(count, bits);
            decoded = decoded << count | bits;
        }
        number = below ? -static_cast<int32_t>(decoded) : static_cast<int32_t>(decoded);
    }

private:
    static constexpr int32_t width_bits = 5;
    std::array<BitModel, 1 << width_bits> width_, second_;
};

// What is learnt of numbers below 16.
class KindModel {
public:
    template <class Coder>
    uint8_t code(Coder& coder, uint8_t kind) {
        uint32_t node = 1;
        for (int32_t k = 3; k >= 0; --k) {
            bool one = (kind >> k & 1) != 0;
            coder.bit(node_[node], one);
            node = node << 1 | (one ? 1u : 0u);
        }
        return static_cast<uint8_t>(node - 16);
    }

private:
    std::array<BitModel, 16> node_;
};

struct LeafModels {
    std::array<BitModel, 3> across;          // whether a triangle lies across a gate: by where its ends lie
    std::array<BitModel, 64> fresh;          // whether it has a new vertex: by the triangles around the gate's ends
    std::array<BitModel, 4> next, previous;  // whether it closes the border on this side of the gate, or on that
    BitModel fresh_corner;                   // of a triangle across no gate
    std::array<KindModel, 6> border;         // LeafVertex::border: by those of the gate's ends
    NumberModel place, along, line, step;    // inside; along a side; across it; LeafVertex::step
    NumberModel position, uv, colour, material;
    std::array<NumberModel, 2> normal;  // inside, on the border
};

}  // namespace lodestone::vgi
