// Stage 5 of the atlas: every cluster of k sides that is no quad yet becomes k quads around a centre. The cluster is
// flattened onto a disk and cut along rays from the vertex nearest to the middle to the middle of each side. Straight
// rays from one point do not meet, so the quads are disks whatever the cluster looks like; rays that go through
// vertices near them (cluster_cut.h) are taken where the same comes of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "vgi/bake/charts/clusters.h"
#include "vgi/bake/charts/features.h"
#include "vgi/bake/charts/surface.h"

namespace lodestone::vgi {

// A quad's corners in order: where the cluster meets others, the middle of the side after that, the cluster's centre,
// the middle of the side before. Those of a cluster that was ready: as they were.
struct Quads {
    Surface surface;              // the input's, cut along all borders of quads
    std::vector<uint32_t> label;  // per triangle: its quad
    struct Quad {
        uint32_t cluster = 0;
        std::array<uint32_t, 4> corners{};  // vertices of the surface
    };
    std::vector<Quad> quads;
    std::vector<uint32_t> failed;   // clusters that could not be cut; then there is nothing else
    std::string fault;              // what was wrong with the first of them
    uint32_t uniform_clusters = 0;  // flattened with equal weights, because the better ones could not be solved

    std::vector<uint32_t> corners() const;  // of all quads, in turn
};

// clusters: of the surface, valid for trace_charts; else Fault::invariant. Fault::interrupted where it is told to stop.
Result<Quads> quadrangulate(Surface surface, const Clusters& clusters, const Progress& progress = {});

// Stages 4 and 5 again, with the roles changed: the quads around a vertex are flattened together, the vertex moves to
// the middle of the picture (or stays, on the surface's boundary), and the cuts that lead to it are made anew, as
// straight as cluster_cut.h makes them. What belongs to which quad changes, not which quads there are. Where that does
// not work, or a border that would move lies on features, the quads stay as they are. Returns how many places were left
// so, or Fault::interrupted: then the quads are of no use.
enum class Pivot {
    corners,  // of clusters
    centres,
    outer_middles,  // of sides from the surface's boundary inwards: borders would run close along it
};
Result<uint32_t> recentre(Quads& quads, Pivot pivot, const FeatureLines& features = {}, const Progress& progress = {});

}  // namespace lodestone::vgi
