// A linear-speed vertex-cache order for a FIFO of known size.
// Sander, Nehab, Barczak, "Fast triangle reordering for vertex locality and reduced overdraw", SIGGRAPH 2007.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lodestone {

// The triangles of `indices` (three per triangle, vertices 0 .. vertex_count-1) in tipsy order. cache_size: FIFO
// entries, >= 3.
std::vector<uint32_t> tipsify(std::span<const uint32_t> indices, uint32_t vertex_count, uint32_t cache_size);

}  // namespace lodestone
