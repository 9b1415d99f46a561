#include "base/files/entropy_coder.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "base/check.h"

namespace lodestone {

namespace {

// Differences repeat little but for runs of zeros: what counts is how they are divided into blocks and their code
// lengths, not searching for matches. Level 12 as it comes takes 1.7 times as long for half a percent more bytes.
constexpr std::array<std::pair<ZSTD_cParameter, int>, 5> compression{{{ZSTD_c_compressionLevel, 12},
                                                                      {ZSTD_c_strategy, ZSTD_btultra},
                                                                      {ZSTD_c_minMatch, 7},
                                                                      {ZSTD_c_searchLog, 1},
                                                                      {ZSTD_c_contentSizeFlag, 0}}};
// What every zstd frame begins with (RFC 8878, 3.1.1); left out here, streams being small.
constexpr std::array<std::byte, 4> magic{std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f}, std::byte{0xfd}};

// A stream is two bytes, the size of its frame and whether it is of pairs, and the frame. Size 0: nothing but zeros.
constexpr size_t header = 2, of_pairs = 1u << 15;

// Of a pair; what is not below it is kept behind the pairs, less by this.
constexpr uint8_t too_large = 15;
// Pairs of numbers of which more are too large take more bytes than the numbers by themselves.
constexpr size_t fewest_per_large = 16;

struct FreeContext {
    void operator()(ZSTD_CCtx* c) const { ZSTD_freeCCtx(c); }
    void operator()(ZSTD_DCtx* c) const { ZSTD_freeDCtx(c); }
};

size_t large_ones(std::span<const uint8_t> numbers) {
    return static_cast<size_t>(std::ranges::count_if(numbers, [](uint8_t n) { return n >= too_large; }));
}
size_t pairs_of(size_t numbers) { return (numbers + 1) / 2; }

std::vector<uint8_t> in_pairs(std::span<const uint8_t> numbers) {
    std::vector<uint8_t> pairs(pairs_of(numbers.size()), 0);
    for (size_t i = 0; i < numbers.size(); ++i) {
        pairs[i / 2] = static_cast<uint8_t>(pairs[i / 2] | std::min(numbers[i], too_large) << (i % 2 == 0 ? 4 : 0));
        if (numbers[i] >= too_large) pairs.push_back(static_cast<uint8_t>(numbers[i] - too_large));
    }
    return pairs;
}

// Whether that many large ones were there.
bool from_pairs(std::span<const uint8_t> pairs, std::span<uint8_t> numbers) {
    size_t large = pairs_of(numbers.size());
    if (pairs.size() < large) return false;
    for (size_t i = 0; i < numbers.size(); ++i) {
        uint32_t number = i % 2 == 0 ? pairs[i / 2] >> 4 : pairs[i / 2] & 15u;
        if (number == too_large) {
            if (large == pairs.size()) return false;
            number += pairs[large++];
        }
        if (number > 255) return false;
        numbers[i] = static_cast<uint8_t>(number);
    }
    return large == pairs.size();
}

}  // namespace

void encode_numbers(std::span<const uint8_t> numbers, std::vector<std::byte>& packed) {
    LODE_CHECK(numbers.size() <= most_encoded_numbers, numbers.size());
    static thread_local std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
    // How much there is is known to whoever unpacks: no size is stored.
    for (const auto& [parameter, value] : compression) ZSTD_CCtx_setParameter(context.get(), parameter, value);
    size_t size = 0;
    bool pairs = false;
    std::vector<std::byte> frame;
    if (!std::ranges::all_of(numbers, [](uint8_t n) { return n == 0; })) {
        pairs = large_ones(numbers) <= numbers.size() / fewest_per_large;
        const std::vector<uint8_t> paired = pairs ? in_pairs(numbers) : std::vector<uint8_t>{};
        const std::span<const uint8_t> plain = pairs ? paired : numbers;
        frame.resize(ZSTD_compressBound(plain.size()));
        size = ZSTD_compress2(context.get(), frame.data(), frame.size(), plain.data(), plain.size());
        LODE_CHECK(!ZSTD_isError(size) && size < of_pairs && size > magic.size() &&
                       std::equal(magic.begin(), magic.end(), frame.begin()),
                   numbers.size());
        size -= magic.size();
        frame.resize(magic.size() + size);
        frame.erase(frame.begin(), frame.begin() + magic.size());
    }
    const size_t word = size | (pairs ? of_pairs : 0);
    packed.push_back(static_cast<std::byte>(word));
    packed.push_back(static_cast<std::byte>(word >> 8));
    packed.insert(packed.end(), frame.begin(), frame.end());
}

std::optional<std::span<const std::byte>> decode_numbers(std::span<const std::byte> packed,
                                                         std::span<uint8_t> numbers) {
    if (packed.size() < header) return std::nullopt;
    const size_t word = std::to_integer<size_t>(packed[0]) | std::to_integer<size_t>(packed[1]) << 8,
                 size = word & (of_pairs - 1);
    const bool pairs = (word & of_pairs) != 0;
    const auto rest = packed.subspan(header);
    if (size > rest.size() || (size == 0 && pairs)) return std::nullopt;
    if (size == 0) {
        std::ranges::fill(numbers, uint8_t{0});
        return rest;
    }
    static thread_local std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
    static thread_local std::vector<std::byte> frame;
    static thread_local std::vector<uint8_t> paired;
    frame.assign(magic.begin(), magic.end());
    frame.insert(frame.end(), rest.begin(), rest.begin() + static_cast<ptrdiff_t>(size));
    if (pairs) paired.resize(pairs_of(numbers.size()) + numbers.size());
    const std::span<uint8_t> plain = pairs ? std::span<uint8_t>(paired) : numbers;
    const size_t got = ZSTD_decompressDCtx(context.get(), plain.data(), plain.size(), frame.data(), frame.size());
    if (ZSTD_isError(got)) return std::nullopt;
    if (pairs ? !from_pairs(plain.first(got), numbers) : got != numbers.size()) return std::nullopt;
    return rest.subspan(size);
}

}  // namespace lodestone
