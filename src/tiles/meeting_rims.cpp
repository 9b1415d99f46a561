#include "tiles/meeting_rims.h"

#include <algorithm>
#include <array>

#include "tiles/tile_tree.h"

namespace lodestone::tiles {

namespace {

using vgi::Atlas;
using Place = std::array<uint16_t, 3>;

struct RimEdge {
    std::array<Place, 2> ends;
    uint32_t side = 0, step = 0;  // 4 chart + side, counter-clockwise
};

std::vector<RimEdge> rim_edges(const Atlas& atlas) {
    std::vector<RimEdge> edges;
    for (uint32_t i = 0; i < atlas.sides.size(); ++i) {
        if (atlas.sides[i].chart != ~0u) continue;
        const uint32_t chart = i / 4, cells = atlas.cells_of(chart);
        const auto place = [&](uint32_t step) {
            const auto [x, y] = vgi::on_side(i % 4, step, cells);
            return atlas.positions[atlas.texel(chart, x, y)];
        };
        for (uint32_t step = 0; step < cells; ++step) {
            if (place(step) != place(step + 1)) edges.push_back({{place(step), place(step + 1)}, i, step});
        }
    }
    return edges;
}

}  // namespace

MeetingRims::MeetingRims(const Atlas& atlas) {
    std::vector<RimEdge> edges = rim_edges(atlas);
    std::ranges::sort(edges, {}, &RimEdge::ends);
    for (const RimEdge& edge : edges) {
        const std::array other_way = {edge.ends[1], edge.ends[0]};
        if (std::ranges::binary_search(edges, other_way, {}, &RimEdge::ends)) steps_[edge.side].push_back(edge.step);
    }
    for (auto& [side, steps] : steps_) std::sort(steps.begin(), steps.end());
}

bool MeetingRims::on(const Atlas& atlas, const ChartSquare& square, uint32_t side) const {
    const auto at = steps_.find(4 * square.chart + side);
    if (at == steps_.end()) return false;
    const uint32_t begin = first_step(atlas, square, side);
    const auto first = std::ranges::lower_bound(at->second, begin);
    return first != at->second.end() && *first < begin + square.cells;
}

}  // namespace lodestone::tiles
