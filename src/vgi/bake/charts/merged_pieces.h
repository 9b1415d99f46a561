// What earlier cuts left behind. Charts are cut out several times, each time a little straighter, and every cut splits
// the triangles that it crosses. Where a cut is no border in the end, the pieces of a source triangle become one again.
#pragma once

#include <cstdint>

#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

// Takes out of a patch's inside vertices that cuts made, wherever the pieces of source triangles around one can be made
// without it: the surface stays what it is. Vertices of the boundary stay, and no two of them are joined anew across
// the inside. The patch is not flattened yet; its vertices and triangles get new numbers where some are taken out.
// uncut: Surface::uncut. Returns how many vertices are taken out.
uint32_t merge_pieces(ChartMesh& patch, uint32_t uncut);

}  // namespace lodestone::vgi
