// The faces around each vertex of an index list.
#pragma once

#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace lodestone {

// indices: three per face, each below `vertices`. A degenerate face is around each of its vertices once.
struct FacesAround {
    std::vector<uint32_t> first, faces;

    FacesAround(std::span<const uint32_t> indices, uint32_t vertices) : first(size_t{vertices} + 1, 0) {
        for (size_t f = 0; f < indices.size(); f += 3) visit(&indices[f], [&](uint32_t v) { ++first[v + 1]; });
        std::partial_sum(first.begin(), first.end(), first.begin());
        faces.resize(first.back());
        std::vector<uint32_t> fill(first.begin(), first.end() - 1);
        for (size_t f = 0; f < indices.size(); f += 3)
            visit(&indices[f], [&](uint32_t v) { faces[fill[v]++] = static_cast<uint32_t>(f / 3); });
    }
    // The distinct vertices of a face.
    template <class Visit>
    static void visit(const uint32_t* face, Visit&& visit) {
        visit(face[0]);
        if (face[1] != face[0]) visit(face[1]);
        if (face[2] != face[0] && face[2] != face[1]) visit(face[2]);
    }
    std::span<const uint32_t> of(uint32_t v) const {
        return std::span(faces).subspan(first[v], first[v + 1] - first[v]);
    }
};

}  // namespace lodestone
