// Streams of small numbers, compressed (zstd): differences, most of them near 0. zstd's codes take
// a whole bit for a byte at least, and numbers of a coarse lattice often tell less: two of them go into a byte where
// nearly all are below 15.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lodestone {

// How many a stream can hold.
inline constexpr size_t most_encoded_numbers = 32000;

// Appends what decode_numbers reads back. Deterministic.
void encode_numbers(std::span<const uint8_t> numbers, std::vector<std::byte>& packed);

// Fills `numbers`, as many as were packed, from the beginning of what is packed, and returns what comes after them;
// nothing where `packed` is broken.
std::optional<std::span<const std::byte>> decode_numbers(std::span<const std::byte> packed, std::span<uint8_t> numbers);

}  // namespace lodestone
