// The order of faces in the index buffer, and how it changes as faces die: what an order is made of, apart from how it
// is stored (progressive_mesh.h) and played (cursor.h).
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "mesh/cache/vertex_cache.h"

namespace lodestone {

class DrawnFaces;  // drawn_faces.h

// The mesh as an order sees it, in the numbers of the progressive mesh.
struct OrderInput {
    std::span<const uint32_t> indices;  // level 0, three wedges per face, faces in the order of the source mesh
    std::span<const uint32_t> death;    // per face: the level from which on it is dead; levels if it outlives all
    std::span<const uint32_t> gone_at;  // per wedge: the level from which on it is gone; levels if it outlives all
    std::span<const uint32_t> parent;   // per wedge: the wedge it becomes then; itself if it outlives all
    uint32_t wedges = 0;                // of full detail
    uint32_t levels = 0;                // of the progressive mesh

    // What a wedge is at a level.
    uint32_t ancestor(uint32_t wedge, uint32_t level) const {
        while (gone_at[wedge] <= level) wedge = parent[wedge];
        return wedge;
    }
};

// What the order "greedy" weighs (greedy_order.h), in the terms of Kuzikowski et al. 2005.
struct GreedyOptions {
    uint32_t group = 96;     // collapses to a group, whose tswaps come at its end; > 0
    uint32_t window = 768;   // slots a group rearranges at most, besides a third as many at the end; >= 32
    uint32_t step = 144;     // slots written between two levels at most; the rest of a group's follow at the next ones
    double in_place = 0.05;  // transforms that a slot written weighs, so that faces that may stay keep their slot
    double line = 0.05;      // transforms that a line weighs that the collapses of the group do not write anyway
    uint32_t line_bytes = 64;  // of a line of the CPU's cache; > 0
    double waiting = 1.35;     // drawn slots to a living face; dead slots wait while there are fewer; > 1
    uint32_t look_ahead = 60;  // faces looked ahead for each choice; 0: none
};

// What orders that are optimised aim at.
struct OrderOptions {
    CacheModel cache;           // FIFO-16 unless said otherwise
    double moves_per_ecol = 8;  // slots written by tswaps per collapse, about; > 0
    GreedyOptions greedy;       // "greedy" only
    double seconds = 60;  // an order takes about so long on two cores at most; large keyframes are then searched less
    // Once it is set, what is left comes in any order, soon; none: it is never set.
    const std::atomic<bool>* stop = nullptr;
};

// Decides on an order; it is asked level after level from full detail on, once.
class FaceOrderer {
public:
    virtual ~FaceOrderer() = default;
    virtual std::string name() const = 0;  // as face_orderer_named() knows it
    // Faces leave the drawn range the moment they die; then the first order must be by falling death.
    virtual bool drops_dead() const { return false; }
    // The order changes by tswaps, a few slots at a time: permute() is asked after every collapse, and neither
    // wants_order() nor reorder(). Otherwise it changes by keyframes.
    virtual bool in_place() const { return false; }
    // Whether OrderOptions::seconds made it search less than it would; known after first_order.
    virtual bool searched_less() const { return false; }
    // Faces (positions in input.indices / 3) by slot at level 0: a permutation.
    virtual std::vector<uint32_t> first_order(const OrderInput& input) = 0;
    // Asked at every level > 0 of an order that does not drop its dead (keyframes: never at two levels running).
    // `alive` faces of `slots` drawn ones are alive.
    virtual bool wants_order(uint32_t level, uint32_t alive, uint32_t slots) = 0;
    // The faces alive at a keyframe, given in the order they have, in the order they shall have.
    // indices: three wedges per face of input.indices, as they are at this level. slots: where each of alive_faces is.
    virtual void reorder(uint32_t level, std::span<const uint32_t> indices, std::span<const uint32_t> slots,
                         std::vector<uint32_t>& alive_faces) = 0;
    // In place: swaps slots on arriving at a level, and shortens the drawn range. written: slots whose faces the
    // collapse to this level rewrote, those that died included.
    virtual void permute(uint32_t level, std::span<const uint32_t> written, DrawnFaces& faces) {
        static_cast<void>(level), static_cast<void>(written), static_cast<void>(faces);
    }
};

// "classic": faces by falling death, so that the faces of every level are a prefix (Forsyth 2001).
// "static": meshoptimizer's cache order of full detail, kept; a keyframe closes the gaps whenever half of the slots are
// dead.
// "greedy": the seed's own optimiser (greedy_order.h).
// "keyframe": ordered anew as faces die, each time for the levels until the next time (keyframe_order.h).
Result<std::unique_ptr<FaceOrderer>> face_orderer_named(const std::string& name, const OrderOptions& options = {});

}  // namespace lodestone
