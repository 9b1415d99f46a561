// Where an open surface ends, as tiles show it: the rims of its holes and its outer ones, at several levels at once.
//
// A tile shows a rim by edges from one of its samples to another farther along. So what a cut leaves over must lead
// along the rim of the finest samples, and all of it together must run through that rim once. Rims may touch: in
// samples that lie at one place, or along whole sides. There several ways lead from one end of an edge to the other,
// and the shortest is not always its own. Ways are laid so that they share what there is of the rim, as wires are:
//
//   L. McMurchie, C. Ebeling, "PathFinder: a negotiation-based performance-driven router for FPGAs", FPGA 1995.
//
// Coarse edges of rims may also cancel, where a hole is a slit at that level or what lies between two holes is a line.
// Nothing is left over of them, so no way leads along what they stand for.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "tiles/check/closed_cuts.h"

namespace lodestone::tiles {

class Rim {
public:
    // A part of the rim from a place to the next.
    struct Edge {
        uint32_t from = 0, to = 0;
        uint32_t times = 0;  // that it is there
    };

    // finest: what the border of the finest samples leaves over.
    explicit Rim(std::span<const BorderEdge> finest);
    bool empty() const { return edges_.empty(); }
    const std::vector<Edge>& edges() const { return edges_; }  // by `from`
    // Those that lead away from a place, numbers of edges().
    std::span<const uint32_t> from(uint32_t place) const;
    // Those of the places that lie on it; sorted, each once.
    std::vector<uint32_t> places_among(std::span<const uint32_t> corners) const;

    // How many edges are left over that are not the rim at some level, and of the rim, how many no edge that is left
    // over stands for: none where a cut is closed, each where a surface without a rim is not.
    // left: of the cut. shown: places_among() the corners of its triangles, in any order.
    uint64_t gaps(std::span<const BorderEdge> left, std::span<const uint32_t> shown) const;

private:
    std::vector<Edge> edges_;
    std::unordered_map<uint32_t, std::vector<uint32_t>> from_;
};

}  // namespace lodestone::tiles
