#include "base/files/entropy_coder.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace lodestone {
namespace {

// Numbers below `most`, and of a hundred `large` that are any.
std::vector<uint8_t> numbers_of(size_t count, uint32_t most, uint32_t large) {
    std::vector<uint8_t> numbers(count);
    for (size_t i = 0; i < count; ++i) {
        const uint64_t noise = mix64(i + 1000003ull * most + large);
        numbers[i] = static_cast<uint8_t>(noise % 100 < large ? noise >> 32 & 255 : (noise >> 32) % most);
    }
    return numbers;
}

TEST(PackedNumbers, ComeBackAndAreRefusedWhereBroken) {
    for (const size_t count : {size_t{1}, size_t{2}, size_t{799}, size_t{3200}, most_encoded_numbers}) {
        for (const uint32_t most : {1u, 2u, 14u, 15u, 16u, 17u, 256u}) {
            for (const uint32_t large : {0u, 3u, 6u, 7u, 100u}) {
                SCOPED_TRACE(::testing::Message() << count << " below " << most << ", large " << large);
                const std::vector<uint8_t> numbers = numbers_of(count, most, large);
                // What comes before and after is left alone.
                std::vector<std::byte> packed(3, std::byte{7});
                encode_numbers(numbers, packed);
                const size_t end = packed.size();
                packed.insert(packed.end(), 5, std::byte{9});
                std::vector<uint8_t> back(count, 77);
                const auto rest = decode_numbers(std::span(packed).subspan(3), back);
                ASSERT_TRUE(rest);
                EXPECT_EQ(rest->size(), 5u);
                ASSERT_EQ(back, numbers);
                const auto cut = std::span(packed).subspan(3, end - 3 - 1);
                EXPECT_FALSE(decode_numbers(cut, back));
                EXPECT_FALSE(decode_numbers({}, back));
                if (end == 3 + 2) continue;  // zeros say nothing of how many there are
                std::vector<uint8_t> fewer(count + 2);
                EXPECT_FALSE(decode_numbers(std::span(packed).subspan(3), fewer));
                // Any byte may be wrong: whatever comes out, nothing is read or written past its end.
                for (size_t i = 3; i < end; i += 1 + end / 64) {
                    std::vector<std::byte> wrong = packed;
                    wrong[i] ^= std::byte{0x41};
                    (void)decode_numbers(std::span(wrong).subspan(3), back);
                }
            }
        }
    }
}

TEST(PackedNumbers, TakeLessThanABitEachWhereTheyTellLess) {
    // One in twenty is not 0: 0.29 bits each.
    std::vector<uint8_t> numbers(9600);
    for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = mix64(i) % 20 == 0;
    std::vector<std::byte> packed;
    encode_numbers(numbers, packed);
    EXPECT_LT(packed.size() * 8, numbers.size() * 6 / 10);
    // Where many are large they stay as they are: 5 bits each and a few for their lengths.
    numbers = numbers_of(9600, 32, 0);
    packed.clear();
    encode_numbers(numbers, packed);
    EXPECT_LT(packed.size() * 8, numbers.size() * 52 / 10);
}

}  // namespace
}  // namespace lodestone
