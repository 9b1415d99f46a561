// Collapses replayed on faces: which corners a wedge has at a level, which faces die.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace lodestone {

// The collapses replayed on faces, with the corners of every wedge in a linked list.
class Replay {
public:
    Replay(std::vector<uint32_t> indices, std::span<const uint32_t> wedge_vertex)
        : indices_(std::move(indices)),
          wedge_vertex_(wedge_vertex),
          first_(wedge_vertex.size(), no_corner),
          last_(wedge_vertex.size(), no_corner),
          next_(indices_.size(), no_corner),
          dead_(indices_.size() / 3, 0) {
        for (uint32_t corner = 0; corner < indices_.size(); ++corner) append(indices_[corner], corner);
    }

    // Corners (3 * face + k) of faces still in range that hold the wedge.
    template <class Visit>
    void for_corners(uint32_t wedge, Visit&& visit) const {
        for (uint32_t c = first_[wedge]; c != no_corner; c = next_[c]) {
            if (dead_[c / 3] < 2) visit(c);
        }
    }
    // The wedge becomes its parent in every corner; faces that thereby lose their area die. Calls died(face) for each.
    template <class Died>
    void rewrite(uint32_t wedge, uint32_t parent, Died&& died) {
        const uint32_t parent_vertex = wedge_vertex_[parent];
        for (uint32_t c = first_[wedge]; c != no_corner;) {
            const uint32_t following = next_[c], face = c / 3;
            if (dead_[face] < 2) {
                if (dead_[face] == 0) {
                    const uint32_t a = indices_[face * 3 + (c + 1 - face * 3) % 3],
                                   b = indices_[face * 3 + (c + 2 - face * 3) % 3];
                    if (wedge_vertex_[a] == parent_vertex || wedge_vertex_[b] == parent_vertex) {
                        dead_[face] = 1;
                        died(face);
                    }
                }
                indices_[c] = parent;
                append(parent, c);
            }
            c = following;
        }
        first_[wedge] = last_[wedge] = no_corner;
    }
    bool alive(uint32_t face) const { return dead_[face] == 0; }
    void leave_range(uint32_t face) { dead_[face] = 2; }
    std::span<const uint32_t> indices() const { return indices_; }

private:
    void append(uint32_t wedge, uint32_t corner) {
        next_[corner] = no_corner;
        if (first_[wedge] == no_corner) {
            first_[wedge] = corner;
        } else {
            next_[last_[wedge]] = corner;
        }
        last_[wedge] = corner;
    }

    static constexpr uint32_t no_corner = ~0u;
    std::vector<uint32_t> indices_;
    std::span<const uint32_t> wedge_vertex_;
    std::vector<uint32_t> first_, last_, next_;
    std::vector<uint8_t> dead_;  // 0 alive, 1 dead within the drawn range, 2 out of range
};

}  // namespace lodestone
