// Where wedges lie in a device's vertex buffer.
//
// Wedges are numbered by removal, so the corners of a triangle have numbers far apart. But there are devices that reuse
// shaded vertices only among indices that agree above their lowest 16 bits (an NVIDIA H200 does:
// CacheModel::batch_index_bits). By number they shade nearly every corner anew once there are more than 65,536 wedges:
// 2.49 vertices a triangle of a cliff of 300k triangles, 0.84 of its source. So wedges lie in regions of 65,536 that
// planes cut the mesh into, and within one in the order in which faces of full detail first use them, which is that of
// vertex fetch. What is left of a region at a coarser level is still together, so that places are good at every level.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lod/asset/progressive_mesh.h"

namespace lodestone {

inline constexpr uint32_t region_wedges = 1u << 16;  // the last region may have less

// By wedge: its place, each of 0 .. wedges - 1 once. order: into pm.orders.
std::vector<uint32_t> vertex_places(const ProgressiveMesh& pm, uint32_t order);

// The places of wedges.
std::vector<uint32_t> placed(std::span<const uint32_t> wedges, std::span<const uint32_t> places);

}  // namespace lodestone
