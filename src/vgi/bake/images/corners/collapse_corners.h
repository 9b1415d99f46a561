// The forest of corners (vgi/asset/corners.h): the two triangles of every chart, all charts together, are a mesh that
// is made coarser corner by corner, the cheapest first, each moved onto a neighbour. A corner is wanted wherever its
// charts are, so it costs no less than what they are off; and as no corner has a smaller error than those that went
// before it, each waits for its turn by what it costs as it is measured.
//
//   H. Hoppe, T. DeRose, T. Duchamp, J. McDonald, W. Stuetzle, "Mesh optimization", SIGGRAPH 1993: the distance of
//   points of the surface that go on to the nearest triangle; Kobbelt, Campagna, Seidel, "A general framework for mesh
//   decimation", Graphics Interface 1998: half-edge collapses.
#pragma once

#include "base/progress.h"
#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

// Fills Atlas::corners and Atlas::chart_corners. Positions, gluing and saturated errors of samples are there. Leaves
// both as they are where it is told to stop.
void collapse_corners(Atlas& atlas, const Progress& progress = {});

}  // namespace lodestone::vgi
