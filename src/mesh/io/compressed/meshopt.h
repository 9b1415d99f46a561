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

// count * stride bytes. Fault::format where the view says what cannot be, or the bytes are no such stream.
// most_bytes: more are refused.
Result<std::vector<unsigned char>> decode_meshopt(std::span<const unsigned char> bytes, const MeshoptView& view,
                                                  uint64_t most_bytes);

}  // namespace lodestone
