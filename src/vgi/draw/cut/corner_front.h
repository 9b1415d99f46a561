// Which corners of charts a cut wants (vgi/asset/corners.h), and the triangles of charts that have not all of theirs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/draw/cut/cut.h"

namespace lodestone::vgi {

class CornerTree;
class RefinementTest;
class Visibility;

// Whether the four corners of any chart may be wanted; else nothing is drawn from samples.
bool any_chart_may_be_whole(const CornerTree& tree, const CutRequest& request, const Atlas& about);

class CornerFront {
public:
    // Corners of the atlas; all of them where `all`. tree, about: must outlive this.
    CornerFront(const CornerTree& tree, const Atlas& about, const RefinementTest& wanted, bool all);

    // Of these charts, rising, those whose four corners are all wanted.
    std::vector<uint32_t> whole_of(std::span<const uint32_t> charts) const;
    // The triangles of all other charts that have an area, for the views that may see them.
    void add_triangles(const Visibility& visibility, CutParts& parts) const;

private:
    bool is_whole(uint32_t chart) const;
    // A corner's nearest wanted ancestor, and how many parents up that is.
    struct Drawn {
        uint32_t corner, steps;
    };
    Drawn drawn(uint32_t corner) const;
    PageBounds around(const std::array<uint32_t, 3>& corners) const;

    const CornerTree& tree_;
    const Atlas& about_;
    const bool all_;
    std::vector<Drawn> front_;  // of the first corners, all those that may be wanted
};

}  // namespace lodestone::vgi
