// Mutations that keep what a decoder checks first: sizes of chunks, checksums, packing. Each changes what is inside by
// libFuzzer's own mutations and puts the outside right again; now and then it lets the outside be damaged, too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace lodestone::fuzz {

// All as LLVMFuzzerCustomMutator: data of `size` bytes, room for `most`; the new size.
size_t mutate_glb(uint8_t* data, size_t size, size_t most, unsigned seed);
size_t mutate_png(uint8_t* data, size_t size, size_t most, unsigned seed);
size_t mutate_gzip(uint8_t* data, size_t size, size_t most, unsigned seed);

// Threes of bytes name a place in what is damaged, modulo its size, and what to write there.
void damage(std::span<std::byte> bytes, std::span<const uint8_t> by);

}  // namespace lodestone::fuzz
