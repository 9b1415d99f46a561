// A cut made of the triangles of the bintree that the pixel error asks for, from what pages are there. Whether a sample
// is in it is a pure function of numbers that all triangles around it share, so the triangles fit together, across
// pages, charts and what is missing, with no look at neighbours.
// The papers are named in sample_errors.h.
#pragma once

#include "vgi/draw/cut/incremental_cut.h"

namespace lodestone::vgi {

// charts: those that some view sees, rising (ChartTree::seen); others may be among them.
// kept: from the instance's cut before, which may have been of anything; takes what this one leaves for the next.
Cut cut_bintree(const Residency& residency, const CutRequest& request, std::span<const uint32_t> charts,
                PageDemand& demand, IncrementalCut& kept);

class BintreeCutter final : public Cutter {
public:
    bool moves_corners() const override { return true; }
    Cut cut(const Residency& residency, const CutRequest& request, std::span<const uint32_t> charts, PageDemand& demand,
            IncrementalCut& kept) const override {
        return cut_bintree(residency, request, charts, demand, kept);
    }
};

}  // namespace lodestone::vgi
