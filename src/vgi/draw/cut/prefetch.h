// Pages that will be wanted further along the camera's way.
#pragma once

#include <cstdint>
#include <span>

#include "vgi/draw/cut/cut.h"

namespace lodestone::vgi {

// Asks `prefetched` for pages that views[0] of the request, an eye further along the way, would want, that are not
// there though their parents are, and that `wanted` does not ask for. They count less than what is wanted now.
// charts: those that some view of the request sees.
void prefetch(const Residency& residency, const CutRequest& request, std::span<const uint32_t> charts,
              const PageDemand& wanted, PageDemand& prefetched);

}  // namespace lodestone::vgi
