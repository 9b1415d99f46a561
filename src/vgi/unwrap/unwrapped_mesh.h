// The mesh that charts, once packed, make together.
#pragma once

#include <span>
#include <vector>

#include "vgi/unwrap/flat_chart.h"
#include "vgi/unwrap/lattice.h"
#include "vgi/unwrap/packing.h"
#include "vgi/unwrap/unwrap.h"

namespace lodestone::vgi {

// source: whose surface the charts are. places, points: of each chart, and of each of its vertices. Triangles come in
// the order of those that they are parts of. Wedges of one vertex that differ in their old texture coordinates alone
// become one in a chart. Of several squares each has materials of its own.
Unwrapped unwrapped_mesh(const TriMesh& source, const std::vector<FlatChart>& charts,
                         std::span<const PackedRectangle> places, const std::vector<std::vector<LatticePoint>>& points,
                         uint32_t squares);

}  // namespace lodestone::vgi
