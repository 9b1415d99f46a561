// Content hashes: XXH3, 128 bits (xxHash by Yann Collet). Fast, not cryptographic.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace lodestone {

// A hash of 128 bits, compared as a value.
struct Hash128 {
    uint64_t low = 0;   // the lower 64 bits
    uint64_t high = 0;  // the upper 64 bits
    bool operator==(const Hash128&) const = default;
    std::string hex() const;  // 32 lower-case digits, high half first
};

// The hash of the bytes; of none, that of an empty text.
Hash128 hash_bytes(std::span<const std::byte> bytes);
// The low half of XXH3's 64 bits: for many small pieces, where 16 bytes a piece would be too many.
uint32_t checksum(std::span<const std::byte> bytes);

// The hash of the values as they lie in memory. T has no padding and no pointers.
template <class T>
Hash128 hash_of(std::span<const T> values) {
    return hash_bytes(std::as_bytes(values));
}

// Hash of bytes that arrive in pieces; equal to hash_bytes of the whole.
class HashStream {
public:
    HashStream();
    ~HashStream();
    HashStream(const HashStream&) = delete;
    HashStream& operator=(const HashStream&) = delete;
    // Goes on with these bytes.
    void add(std::span<const std::byte> bytes);
    Hash128 digest() const;  // of all bytes added so far; more may follow

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace lodestone
