// What is kept of an instance's cut for the next one to take over where nothing has changed: of squares of the bintree
// their triangles, and how far the camera may go before any decision in them can turn out otherwise.
//
// What is taken over is what a cut from scratch would have made, in the same order.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

// A square (bintree_cut.h) as it was cut, all that lies in it included.
struct CachedSquare {
    std::array<uint32_t, 4> corners;  // indices
    uint16_t level, x, y;
    uint16_t beside_leaves;  // inside a finest page's square: LeafFront::beside_wanted
    // The views it was looked at for, and those that its triangles are for.
    uint32_t looked_at, drawn_for;
    GeometryTexel centre;
    Slack slack;                      // of all decisions in it; unsteady where it has triangles for other views, too
    uint32_t first_index, indices;    // in the list of drawn_for
    uint32_t first_touched, touched;  // in CachedCharts::touched
    uint32_t squares;                 // kept ones in it, which follow this one
};

// Of charts that are cut one after another.
struct CachedCharts {
    CutParts parts;
    std::vector<CachedSquare> squares;  // chart after chart, each before those in it
    std::vector<uint32_t> touched;      // pages, as PageDemand::touched; those of a square together
    std::vector<uint32_t> first;        // per chart, of its squares; one more at the end
    uint32_t cut = 0;                   // IncrementalCut::cuts when it was made

    // Keeps the room there is.
    void clear() {
        parts.clear();
        squares.clear();
        touched.clear();
        first.clear();
    }
};

// Of an instance.
struct IncrementalCut {
    std::vector<CachedCharts> charts, before;  // of this cut, and of the one before: room to be used again
    std::optional<RefinementTest> wanted;
    std::optional<Visibility> visibility;
    const PageTopology* topology = nullptr;  // null: nothing to go on from
    uint32_t cuts = 0;                       // made so far
    uint64_t updates = 0;                    // Residency::updates
    int64_t forced_level = -1;
    uint64_t taken_over = 0;  // triangles of the last cut, for statistics
    uint64_t words = 0;       // of the last cut
};

}  // namespace lodestone::vgi
