// Which charts are near a place: a grid around an atlas, and of each of its cells the charts that are nearest. A
// triangle of moved corners stands for many charts: what is seen at a pixel of it is looked up in the chart that lies
// there (shaders/shared/vgi_place.glsl).
#pragma once

#include <vector>

#include "vgi/draw/corners/corner_tree.h"

namespace lodestone::vgi {

// As the table of corners has it (LODE_VGI_CORNERS). Nothing for an atlas without corners. The two triangles of a chart
// are taken for it. A cell has the chart nearest to its middle, the nearest of those that face along each axis, one way or
// the other, and of those nearest to its corners as many as there is room for.
std::vector<CornerRecord> chart_grid(const Atlas& about);

}  // namespace lodestone::vgi
