#include "base/files/range_coder.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "base/random.h"

namespace lodestone {
namespace {

// Bits of any likelihood come back, and take about what they tell.
TEST(RangeCoder, CodesBitsAtTheirEntropy) {
    for (const uint32_t of_1000 : {0u, 1u, 20u, 300u, 500u, 990u, 1000u}) {
        constexpr size_t count = 20000;
        Random random(of_1000 + 1);
        std::vector<uint8_t> bits;
        for (size_t i = 0; i < count; ++i) bits.push_back(random.below(1000) < of_1000 ? 1 : 0);
        RangeEncoder encoder;
        BitModel model;
        for (const uint8_t b : bits) {
            bool bit = b != 0, even = (b ^ 1) != 0;
            encoder.bit(model, bit);
            if (of_1000 == 300) encoder.even_bit(even);
        }
        std::vector<std::byte> bytes;
        encoder.finish(bytes);
        const double p = of_1000 / 1000.0,
                     entropy = p > 0 && p < 1 ? -p * std::log2(p) - (1 - p) * std::log2(1 - p) : 0;
        EXPECT_LT(static_cast<double>(bytes.size()),
                  count / 8.0 * (1.08 * entropy + (of_1000 == 300 ? 1 : 0) + 0.01) + 8)
            << of_1000;
        RangeDecoder decoder(bytes);
        BitModel same;
        for (size_t i = 0; i < count; ++i) {
            bool bit = false, even = false;
            decoder.bit(same, bit);
            ASSERT_EQ(bit, bits[i] != 0) << of_1000 << ", " << i;
            if (of_1000 != 300) continue;
            decoder.even_bit(even);
            ASSERT_EQ(even, bits[i] == 0);
        }
        EXPECT_TRUE(decoder.at_end());
    }
}

TEST(RangeCoder, GivesBackEvenBitsTogether) {
    Random random(3);
    std::vector<std::array<uint32_t, 2>> coded;
    RangeEncoder encoder;
    BitModel model;
    size_t whole = 0;
    for (int i = 0; i < 20000; ++i) {
        const auto count = static_cast<uint32_t>(random.below(most_even_bits + 1));
        // All of them set carries far.
        uint32_t value = i % 3 == 0 ? (1u << count) - 1 : static_cast<uint32_t>(random.below(uint64_t{1} << count));
        bool bit = value % 2 != 0;
        encoder.even_bits(count, value);
        encoder.bit(model, bit);
        coded.push_back({count, value});
        whole += count + 1;
    }
    std::vector<std::byte> bytes;
    encoder.finish(bytes);
    EXPECT_LT(bytes.size() * 8, whole + whole / 100);
    RangeDecoder decoder(bytes);
    BitModel same;
    for (const auto& [count, value] : coded) {
        uint32_t decoded = 0;
        bool bit = false;
        decoder.even_bits(count, decoded);
        decoder.bit(same, bit);
        ASSERT_EQ(decoded, value);
        ASSERT_EQ(bit, value % 2 != 0);
    }
    EXPECT_TRUE(decoder.at_end());
}

// Carries run through many bytes of 0xff.
TEST(RangeCoder, KnowsItsEnd) {
    RangeEncoder encoder;
    bool one = true;
    for (int i = 0; i < 400; ++i) encoder.even_bit(one);
    std::vector<std::byte> bytes;
    encoder.finish(bytes);
    const auto ends = [](std::span<const std::byte> given) {
        RangeDecoder decoder(given);
        for (int i = 0; i < 400; ++i) {
            bool bit = false;
            decoder.even_bit(bit);
        }
        return decoder.at_end();
    };
    EXPECT_TRUE(ends(bytes));
    EXPECT_FALSE(ends(std::span(bytes).first(bytes.size() - 1)));
    bytes.push_back(std::byte{0});
    EXPECT_FALSE(ends(bytes));
}

}  // namespace
}  // namespace lodestone
