// The order in which a mesh loses its vertices: what a simplifier makes and a progressive mesh is baked from.
// Any producer will do; the bake neither knows nor cares how the list came about.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/files/chunk_file.h"
#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// One half-edge collapse: vertex `removed` moves onto its neighbour `kept`. Each wedge of `removed` that is still in
// use becomes a wedge of `kept`: `wedge_count` pairs from CollapseList::wedge_pairs, starting at `first_wedge`.
struct Collapse {
    uint32_t removed = 0, kept = 0;  // vertices of the input mesh; a removed vertex never appears again
    uint32_t first_wedge = 0;        // into wedge_pairs
    uint32_t wedge_count = 0;        // >= 1; more than one on a seam (paired collapses)
};

// A wedge that a collapse takes away, and the one that stands for it.
struct WedgePair {
    uint32_t removed = 0, kept = 0;  // wedges of the input mesh
};

// Why no further collapse was made.
enum class StopReason {
    target_reached,  // no more than the wanted triangles are left
    topology,        // every collapse left would change the topology (link condition) or tear a boundary or seam
    flips,           // every collapse left that topology allows would turn a triangle over
};
std::string describe(StopReason reason);  // a sentence for the user

// All collapses, in order.
struct CollapseList {
    std::vector<Collapse> collapses;               // from full detail downwards
    std::vector<WedgePair> wedge_pairs;            // collapse after collapse
    StopReason stop = StopReason::target_reached;  // why the list ends
    uint64_t blocked_by_topology = 0;              // candidate collapses refused in the end, by reason
    uint64_t blocked_by_flips = 0;                 // those that would turn a triangle over

    // Chunks lod/collapses, lod/wedge_pairs, lod/collapse_counts.
    Result<void> write_chunks(ChunkWriter& writer) const;
    // Fault::format where the chunks are not there. Does not look at what is in them: validate() does.
    static Result<CollapseList> open(const ChunkFile& file);

    // Replays the list on the connectivity of `mesh`: indices in range, each removed vertex alive until its collapse
    // and joined to `kept` by an edge, every wedge in use paired, no triangle made twice, manifold kept. Names the
    // first fault.
    Result<void> validate(const TriMesh& mesh) const;
};

}  // namespace lodestone
