// A cut made of the nodes of a quadtree over each chart, every node a uniform grid of at most 8 x 8 cells of one mip
// level, as in the seed's virtual geometry images. Where two nodes of different levels meet, across charts too, the
// vertices that only the finer one has on their border are collapsed into those that both have.
//
//   Losasso, Hoppe, Smith, Warren, "Smooth geometry images", SGP 2003, for images drawn by mip level; the seed, section
//   2.2, for nodes and collapsed borders.
//
// By error (the default) a node is divided iff the next finer level has a sample in it that is wanted, so every sample
// that a bintree cut of the same request has is drawn here too, and the two can be compared. By area, as the seed has
// it, a node is divided iff the square root of the area that it covers on screen, by a bound, is more than its cells
// may take; flat and rough parts are drawn alike.
//
// Neighbours differ by three levels at most: then corners of nodes are samples of all nodes that touch them, and a
// border is the business of two nodes alone.
#pragma once

#include "vgi/draw/cut/cut.h"

namespace lodestone::vgi {

// What the parts of a cut hold.
enum class GridOutput {
    indices,  // of triangles; flat ones are left out
    patches,  // LODE_VGI_PATCH_WORDS words for every node, for a device that tessellates
};

// When a node is divided.
enum class GridRule {
    by_error,
    by_area,  // by what it covers on screen, with no regard to errors: a cell may be pixels_per_cell * pixel_error wide
};
inline constexpr double pixels_per_cell = 8;

Cut cut_grid(const Residency& residency, const CutRequest& request, PageDemand& demand, GridOutput output,
             GridRule rule = GridRule::by_error);

class GridCutter final : public Cutter {
public:
    GridCutter(GridOutput output, GridRule rule) : output_(output), rule_(rule) {}
    bool makes_triangles() const override { return output_ == GridOutput::indices; }
    // All charts are looked at.
    Cut cut(const Residency& residency, const CutRequest& request, std::span<const uint32_t>, PageDemand& demand,
            IncrementalCut&) const override {
        return cut_grid(residency, request, demand, output_, rule_);
    }

private:
    GridOutput output_;
    GridRule rule_;
};

}  // namespace lodestone::vgi
