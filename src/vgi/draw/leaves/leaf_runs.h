// Runs of a leaf's triangles: what views leave out of a leaf that they see in part, where its vertices are in their
// places.
#pragma once

#include <cstdint>
#include <vector>

#include "vgi/asset/leaves/leaves.h"

namespace lodestone::vgi {

inline constexpr uint32_t leaf_run_triangles = 32;  // of each run of a part but its last

// Of the triangles of a part, in their order: of each run the sphere that holds it, and the cone that holds its normals
// (PageBounds::axis, cosine).
std::vector<PageBounds> leaf_runs(const Atlas& about, const LeafPart& part);

}  // namespace lodestone::vgi
