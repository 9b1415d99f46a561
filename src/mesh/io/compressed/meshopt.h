// Bytes that meshoptimizer has compressed, as EXT_meshopt_compression of glTF has them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace lodestone {

// What a buffer view says of its bytes.
struct MeshoptView {
    uint64_t count = 0, stride = 0;  // elements, and bytes of each
    std::string mode;                // ATTRIBUTES, TRIANGLES or INDICES
    std::string filter;              // NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL; empty for none
};

// Whether so many bytes may unpack to so many: two bits stand for sixteen bytes at least. What promises more is not given
// the memory.
inline bool meshopt_may_hold(uint64_t bytes, uint64_t unpacked) { return unpacked / 64 <= bytes + 256; }

// count * stride bytes. Fault::format where the view says what cannot be, or the bytes are no such stream.
// most_bytes: more are refused.
Result<std::vector<unsigned char>> decode_meshopt(std::span<const unsigned char> bytes, const MeshoptView& view,
                                                  uint64_t most_bytes);

}  // namespace lodestone
