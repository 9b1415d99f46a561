#include "lod/bake/simplify/wedge_replay.h"

#include <algorithm>

#include "base/check.h"
#include "mesh/topology.h"

namespace lodestone {

WedgeReplay::WedgeReplay(const TriMesh& mesh)
    : mesh_(mesh), corners_(mesh.vertex_count()), triangles_(mesh.triangle_count()) {
    wedges_.reserve(mesh.triangle_count() * 3);
    for (const Triangle& t : mesh.triangles) {
        for (const uint32_t w : t) {
            corners_[mesh.wedge_vertex[w]].push_back(static_cast<uint32_t>(wedges_.size()));
            wedges_.push_back(w);
        }
    }
}

std::pair<bool, std::vector<WedgePair>> WedgeReplay::pairs(uint32_t u, uint32_t v) const {
    std::vector<WedgePair> found;
    const auto partner = [&](uint32_t wedge) {
        return std::find_if(found.begin(), found.end(), [&](const WedgePair& p) { return p.removed == wedge; });
    };
    bool consistent = true;
    for (const uint32_t c : corners_[u]) {
        if (vertex(next_corner(c)) != v && vertex(previous_corner(c)) != v) continue;
        const uint32_t to = vertex(next_corner(c)) == v ? wedges_[next_corner(c)] : wedges_[previous_corner(c)];
        const auto known = partner(wedges_[c]);
        if (known == found.end()) {
            found.push_back({wedges_[c], to});
        } else {
            consistent = consistent && known->kept == to;
        }
    }
    for (const uint32_t c : corners_[u]) consistent = consistent && partner(wedges_[c]) != found.end();
    return {consistent && !found.empty(), std::move(found)};
}

void WedgeReplay::collapse(uint32_t u, uint32_t v, CollapseList& list) {
    const auto [possible, found] = pairs(u, v);
    LODE_CHECK(possible, u, v);
    list.collapses.push_back(
        {u, v, static_cast<uint32_t>(list.wedge_pairs.size()), static_cast<uint32_t>(found.size())});
    list.wedge_pairs.insert(list.wedge_pairs.end(), found.begin(), found.end());
    for (const uint32_t c : corners_[u]) {
        const uint32_t a = vertex(next_corner(c)), b = vertex(previous_corner(c));
        if (a == v || b == v) {
            // The face dies: it leaves the lists of its other two corners.
            for (const uint32_t other : {next_corner(c), previous_corner(c)})
                std::erase(corners_[vertex(other)], other);
            --triangles_;
            continue;
        }
        wedges_[c] = std::find_if(found.begin(), found.end(), [&, w = wedges_[c]](const WedgePair& p) {
                         return p.removed == w;
                     })->kept;
        corners_[v].push_back(c);
    }
    corners_[u].clear();
}

}  // namespace lodestone
