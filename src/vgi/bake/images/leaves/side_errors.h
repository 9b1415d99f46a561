// What a leaf that is drawn beside samples is off by: there its vertices go to the nearest samples of the side
// (vgi/asset/leaves/leaves.h), by up to half a cell, and triangles go with them, off ridges that they lay along.
#pragma once

#include <array>
#include <span>

#include "vgi/asset/atlas.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/sample_depths.h"

namespace lodestone::vgi {

// Per side of the square of a page, where that side alone is beside samples, both ways; object units. parts: of the
// leaf.
std::array<double, 4> side_errors(const Atlas& atlas, const SampleDepths& depths, Atlas::Tile square,
                                  std::span<const LeafPart> parts);

}  // namespace lodestone::vgi
