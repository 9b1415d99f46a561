// The baseline `full`: the source mesh, in the best order a user would give it.
#pragma once

#include <cstdint>
#include <span>

#include "baseline/fixed_levels.h"

namespace lodestone {

// The mesh as one level: faces in meshoptimizer's vertex-cache order, vertices in the order they are then fetched.
// Degenerate triangles are left out. further: none, or as many as vertices.
FixedLevels full_level(std::span<const MeshVertex> vertices, std::span<const uint32_t> indices,
                       std::span<const FurtherAttributes> further = {});

}  // namespace lodestone
