// Parts of leaves as bytes: which vertices triangles have, and what vertices differ by from what the triangles around
// them let expect. Each part is coded by itself.
//
//   Gumhold, Strasser, "Real time compression of triangle mesh connectivity", 1998, for a border that grows by a
//   triangle at a time; Touma, Gotsman, "Triangle mesh compression", 1998, for places across an edge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/asset/leaves/leaves.h"

namespace lodestone::vgi {

// How many triangles a coded part has, as its beginning says; 0 of fewer bytes.
inline constexpr size_t leaf_header_bytes = 4;
inline uint32_t triangles_in_leaf(std::span<const std::byte> begin) {
    return begin.size() < leaf_header_bytes ? 0
                                            : static_cast<uint32_t>(begin[1]) | static_cast<uint32_t>(begin[2]) << 8;
}

// The same part, its triangles in the order in which they are coded in the fewest bytes, its vertices in the order in
// which these first use them. Every triangle but a few has an edge of one before as its first, the other way round.
LeafPart in_coding_order(const LeafPart& part);

// What is coded, in whatever order triangles are. Vertices must be numbered in the order that triangles first use them.
std::vector<std::byte> encode_leaf(const LeafPart& part, const AtlasAttributes& attributes);
// Fault::format where the bytes are those of no part.
Result<LeafPart> decode_leaf(std::span<const std::byte> bytes, const AtlasAttributes& attributes);

}  // namespace lodestone::vgi
