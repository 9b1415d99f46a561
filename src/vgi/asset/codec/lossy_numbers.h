// How numbers of a lossy family (lossy_family.h) are coded, in both directions: coefficients of blocks and samples of
// borders. Most are 0; how likely that is is told by what is around them.
//
//   Marpe, Schwarz, Wiegand, "Context-based adaptive binary arithmetic coding", 2003, for signs and sizes apart and for
//   contexts of neighbours.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "base/files/range_coder.h"
#include "vgi/asset/codec/block_transform.h"

namespace lodestone::vgi {

// Place in a block of the nth coefficient, from the mean to the finest.
inline constexpr std::array<uint8_t, 64> zigzag = [] {
    std::array<uint8_t, 64> places{};
    size_t i = 0;
    for (int sum = 0; sum < 15; ++sum) {
        for (int k = 0; k <= sum; ++k) {
            const int x = sum % 2 == 0 ? k : sum - k, y = sum - x;
            if (x < 8 && y < 8) places[i++] = static_cast<uint8_t>(8 * y + x);
        }
    }
    return places;
}();

// What is learnt of components of one kind.
class LossyNumbers {
public:
    // Whether a block has any coefficient that is not 0. around: 0 .. 5, more the likelier.
    template <class Coder>
    void code_any(Coder& coder, uint32_t around, bool& any) {
        coder.bit(any_[around], any);
    }
    // The coefficients of a block that has some.
    template <class Coder>
    void code_block(Coder& coder, std::span<int16_t, 64> block) {
        uint32_t last = 0;  // the last that is not 0
        for (uint32_t i = 0; i < 64; ++i) {
            if (block[zigzag[i]] != 0) last = i;
        }
        uint32_t node = 1;
        for (int32_t b = 5; b >= 0; --b) {
            bool one = (last >> b & 1) != 0;
            coder.bit(last_[node], one);
            node = node << 1 | (one ? 1u : 0u);
        }
        last = node - 64;
        std::array<uint8_t, wide * wide> sizes{};
        for (uint32_t i = last + 1; i-- > 0;) {
            const uint32_t zone = i == 0   ? 0
                                  : i < 6  ? 1
                                  : i < 21 ? 2
                                           : 3,
                           place = zigzag[i], at = place + place / 8 * (wide - 8);
            code_number(coder, block_[zone][kind_of_sum[sum_around(sizes, at)]], i == last, block[place]);
            sizes[at] = static_cast<uint8_t>(std::min(std::abs(int32_t{block[place]}), most_counted));
        }
    }
    // A sample of a border. before: the two coded before it.
    template <class Coder>
    void code_border(Coder& coder, int32_t before, int32_t before_that, int16_t& number) {
        const auto around = static_cast<size_t>(std::min(2 * std::abs(before) + std::abs(before_that), 5));
        code_number(coder, border_[around], false, number);
    }

private:
    static constexpr uint32_t most_units = 14;
    // Sizes: whether more than 0, more than 1, more than that.
    struct Sizes {
        std::array<BitModel, 3> more;
    };
    // Sizes of coefficients, as far as they count, with two of 0 beyond each row and column.
    static constexpr uint32_t wide = 10;
    static constexpr int32_t most_counted = 4;
    // Of finer coefficients of the block.
    static uint32_t sum_around(const std::array<uint8_t, wide * wide>& sizes, uint32_t at) {
        return uint32_t{sizes[at + 1]} + sizes[at + wide] + sizes[at + wide + 1] + sizes[at + 2] + sizes[at + 2 * wide];
    }
    static constexpr std::array<uint8_t, 5 * most_counted + 1> kind_of_sum{0, 1, 2, 3, 3, 4, 4, 4, 5, 5, 5,
                                                                           5, 5, 5, 5, 5, 5, 5, 5, 5, 5};
    template <class Coder>
    void code_number(Coder& coder, Sizes& sizes, bool is_not_0, int16_t& number) {
        auto size = static_cast<uint32_t>(std::abs(int32_t{number}));
        uint32_t known = is_not_0 ? 1 : 0;
        for (bool more = true; more && known < most_units; known += more ? 1 : 0) {
            more = size > known;
            coder.bit(sizes.more[std::min(known, 2u)], more);
        }
        if (known == most_units) known += code_rest(coder, size - most_units);
        bool below = number < 0;
        if (known > 0) coder.even_bit(below);
        number = static_cast<int16_t>(below ? -static_cast<int32_t>(known) : static_cast<int32_t>(known));
    }
    // Exp-Golomb: how many bits, then the bits. rest: below 2^15.
    template <class Coder>
    uint32_t code_rest(Coder& coder, uint32_t rest) {
        uint32_t bits = 0;
        for (bool more = true; more && bits < 14; bits += more ? 1 : 0) {
            more = rest + 1 >= 2u << bits;
            coder.bit(bits_[bits], more);
        }
        uint32_t decoded = 1;
        for (uint32_t b = bits; b-- > 0;) {
            bool one = ((rest + 1) >> b & 1) != 0;
            coder.even_bit(one);
            decoded = decoded << 1 | (one ? 1u : 0u);
        }
        return decoded - 1;
    }

    std::array<BitModel, 6> any_;
    std::array<BitModel, 64> last_;
    std::array<std::array<Sizes, 6>, 4> block_;
    std::array<Sizes, 6> border_;
    std::array<BitModel, 14> bits_;
};

}  // namespace lodestone::vgi
