// Where rims of an open surface lie on each other: a source whose edges have three triangles or more is cut apart
// there, and one of pieces side by side may not be joined. The finest samples of such rims are the same, so nothing is
// seen of it where leaves are shown; tiles of different levels would gape.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "vgi/asset/atlas.h"

namespace lodestone::tiles {

struct ChartSquare;

// Edges between the finest samples of rims that are run through the other way by another rim, or by the same.
class MeetingRims {
public:
    MeetingRims() = default;  // none
    explicit MeetingRims(const vgi::Atlas& atlas);
    // Whether there is one on the side of a square.
    bool on(const vgi::Atlas& atlas, const ChartSquare& square, uint32_t side) const;

private:
    std::unordered_map<uint32_t, std::vector<uint32_t>> steps_;  // of side 4 chart + side: where they begin, rising
};

}  // namespace lodestone::tiles
