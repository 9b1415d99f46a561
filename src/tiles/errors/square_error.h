// How far a square of a tile is from the finest surface that it stands for.
//
// The map of a chart is linear on each triangle of its samples and of its leaves. So the finest triangles of a square
// are cut, in the chart, along the lines of the coarser samples: on each piece both surfaces are linear, so it is no
// farther from the other than its corners are from where they are there.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tiles/errors/farthest.h"
#include "tiles/finest.h"

namespace lodestone::tiles {

// Measures squares of one chart; steps of the atlas's lattice.
class SquareErrors {
public:
    // atlas and finest must outlive this. resolution: what is nearer counts as touching.
    SquareErrors(const vgi::Atlas& atlas, const FinestSurface& finest, double resolution)
        : atlas_(atlas), finest_(finest), resolution_(resolution) {}

    // The largest distance of the square's samples, `stride` finest ones apart, and of what closes some of its sides,
    // to its finest surface, or of that to its samples, to 2% (farthest.h). stride: at least 2.
    double error(const ChartSquare& square, uint32_t stride, const std::vector<uint32_t>& sides);

private:
    struct Finest {
        ChartSquare square;
        FinestTriangles triangles;
        TargetSurface surface;
    };
    const vgi::Atlas& atlas_;
    const FinestSurface& finest_;
    const double resolution_;
    std::optional<Finest> at_hand_;  // of the square before, which is often the same
};

}  // namespace lodestone::tiles
