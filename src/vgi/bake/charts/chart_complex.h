// A labelled surface as a complex of patches: corners where three or more meet, arcs between corners, and the sides of
// each patch.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

// A chain of edges between the same two patches.
struct Arc {
    std::vector<uint32_t> vertices;  // of the surface, from corner to corner, both included; at least 2
    uint32_t left = none;            // patch on the left of that direction
    uint32_t right = none;           // and on the right; none on the boundary of the surface
    double length = 0;               // object units
};

// Where its vertices lie along it, 0 .. 1, rising: by length, but no step is less than a hundred-thousandth of it, so
// that edges of hardly any length do not fold the chart beside them.
std::vector<double> places_along(const Arc& arc, const std::vector<glm::dvec3>& positions);

// An arc as a side of a patch.
struct Side {
    uint32_t arc = 0;       // into ChartComplex::arcs
    bool reversed = false;  // run against the arc's direction
};

// Arcs, and the patches they bound.
struct ChartComplex {
    std::vector<Arc> arcs;                 // by number
    std::vector<std::vector<Side>> sides;  // per patch, counter-clockwise seen from outside

    // The corner that a side begins at.
    uint32_t begin_of(const Side& side) const {
        const std::vector<uint32_t>& v = arcs[side.arc].vertices;
        return side.reversed ? v.back() : v.front();
    }
};

// Triangles of each patch, in rising order.
std::vector<std::vector<uint32_t>> members_of(std::span<const uint32_t> label, uint32_t count);

// Finds the arcs between patches and the sides of each.
// label: per triangle, 0 .. count - 1. corners: vertices of borders that are corners even where only two meet; there
// patches may touch in more than one place. Fault::invariant where a patch is not a disk with at least three sides or
// two patches touch in more than a point or an arc; the message names them.
Result<ChartComplex> trace_charts(const Surface& surface, std::span<const uint32_t> twins,
                                  std::span<const uint32_t> label, uint32_t count,
                                  std::span<const uint32_t> corners = {});

}  // namespace lodestone::vgi
