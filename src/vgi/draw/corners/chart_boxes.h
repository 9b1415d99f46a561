// Boxes around the charts of an atlas, in boxes around these: which chart is nearest to a place. A triangle of moved
// corners stands for many charts; what is seen at a pixel of it is looked up in the chart that lies there
// (shaders/shared/vgi_place.glsl).
#pragma once

#include <vector>

#include "vgi/draw/corners/corner_tree.h"

namespace lodestone::vgi {

// A tree of 2 * charts - 1 boxes, as the table of corners has it (LODE_VGI_CORNERS), the root first; nothing for an
// atlas without corners. A chart's four corners are taken for it. Each box has two that hold half of its charts each,
// divided where they are widest, so no path is longer than LODE_VGI_BOX_DEPTH.
std::vector<CornerRecord> chart_boxes(const Atlas& about);

}  // namespace lodestone::vgi
