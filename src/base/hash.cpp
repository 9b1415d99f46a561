#include "base/hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstdio>

namespace lodestone {

namespace {
Hash128 from(XXH128_hash_t h) { return {h.low64, h.high64}; }
}  // namespace

std::string Hash128::hex() const {
    char text[33];
    std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(high),
                  static_cast<unsigned long long>(low));
    return text;
}

Hash128 hash_bytes(std::span<const std::byte> bytes) { return from(XXH3_128bits(bytes.data(), bytes.size())); }

uint32_t checksum(std::span<const std::byte> bytes) {
    return static_cast<uint32_t>(XXH3_64bits(bytes.data(), bytes.size()));
}

struct HashStream::State {
    XXH3_state_t* xxh = XXH3_createState();
};

HashStream::HashStream() : state_(std::make_unique<State>()) { XXH3_128bits_reset(state_->xxh); }
HashStream::~HashStream() { XXH3_freeState(state_->xxh); }
void HashStream::add(std::span<const std::byte> bytes) { XXH3_128bits_update(state_->xxh, bytes.data(), bytes.size()); }
Hash128 HashStream::digest() const { return from(XXH3_128bits_digest(state_->xxh)); }

}  // namespace lodestone
