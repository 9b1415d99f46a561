// Plays half-edge collapses on the wedges of a mesh and writes them down as a collapse list; for simplifiers that know
// vertices only.
#pragma once

#include <vector>

#include "lod/bake/simplify/collapse_list.h"

namespace lodestone {

class WedgeReplay {
public:
    explicit WedgeReplay(const TriMesh& mesh);  // which must outlive this
    // Every wedge of u in use has one partner at v across the faces between them.
    bool can_collapse(uint32_t u, uint32_t v) const { return pairs(u, v).first; }
    // u goes to v; adds to the list. can_collapse(u, v).
    void collapse(uint32_t u, uint32_t v, CollapseList& list);
    size_t triangles_left() const { return triangles_; }

private:
    std::pair<bool, std::vector<WedgePair>> pairs(uint32_t u, uint32_t v) const;
    uint32_t vertex(uint32_t corner) const { return mesh_.wedge_vertex[wedges_[corner]]; }

    const TriMesh& mesh_;
    std::vector<uint32_t> wedges_;                // per corner, 3 * triangle + k
    std::vector<std::vector<uint32_t>> corners_;  // per vertex
    size_t triangles_;
};

}  // namespace lodestone
