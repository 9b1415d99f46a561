// What a tessellator makes of draws of patches, done on the CPU from the same buffers: for measurements and tests.
#pragma once

#include <vector>

#include "frame/plan_mirror.h"

namespace lodestone::vgi {

// Of a draw of patches: what the tessellator makes of them, by index. Empty for other draws.
std::vector<uint32_t> patch_indices(const PlanMirror& mirror, const Draw& draw);

}  // namespace lodestone::vgi
