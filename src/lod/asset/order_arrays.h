// From what an order is, the faces slot by slot at full detail and at every keyframe, to what a cursor plays: which
// corners every ecol rewrites, and how each keyframe comes from the one before.
//
// The bake decides on orders, the asset stores what was decided, and this follows from it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lod/asset/progressive_mesh.h"

namespace lodestone {

// An order of faces from a level on.
struct PlannedKeyframe {
    uint32_t level = 0;           // 0 of the first one; the others as Keyframe::level
    std::vector<uint32_t> faces;  // by slot: all that are alive at the level, as numbers of faces
};
struct PlannedOrder {
    std::string name;
    bool drops_dead = false;              // there is then but one order, of all faces by number
    std::vector<PlannedKeyframe> orders;  // by rising level, at least one; only one where there are tswaps
    // As FaceOrder; none where there are keyframes.
    std::vector<TswapStep> tswaps;
    std::vector<uint32_t> cycle_lengths, cycle_slots;
};

// What all orders of a mesh have in common. Faces are numbered by falling death: those alive at a level are a prefix.
struct PlayedMesh {
    std::span<const Ecol> ecols;
    std::span<const uint32_t> parents;       // as ProgressiveMesh
    std::span<const uint32_t> wedge_vertex;  // as ProgressiveMesh
    uint32_t wedges = 0;                     // of full detail
    std::span<const uint32_t> indices;       // of full detail, three wedges per face
    // Per face: an older one that has all of its vertices once it is dead, ~0 for none.
    std::span<const uint32_t> witnesses;
    // Per split from coarse to fine the corners that take its new vertex, without those of faces that are born; 3 *
    // face + k. And where they end.
    std::span<const uint32_t> arcs;
    std::span<const uint64_t> arc_ends;
};

// What the spans of a FaceOrder refer to.
struct OrderArrays {
    std::vector<uint32_t> indices;
    std::vector<uint64_t> first_corner;
    std::vector<uint32_t> corners;
    std::vector<TswapStep> tswaps;
    std::vector<uint32_t> cycle_lengths, cycle_slots;
    std::vector<Keyframe> keyframes;
    std::vector<uint64_t> block_ends;
    std::vector<uint8_t> block_bytes;

    // A face order that refers to these.
    FaceOrder order(std::string name, bool drops_dead) const;
};

// Fault::format where the index buffer is over Limits::lod_indices, or a cycle makes no sense.
Result<OrderArrays> arrays_of(const PlayedMesh& mesh, const PlannedOrder& order);

}  // namespace lodestone
