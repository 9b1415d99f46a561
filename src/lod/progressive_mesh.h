// A progressive mesh as it is stored and played back: vertices, half-edge collapses, and for each face order one index
// buffer with the changes that carry it from level to level.
//
//   Hoppe, "Progressive Meshes", SIGGRAPH 1996 (the sequence of vsplits); "Efficient implementation of progressive
//   meshes", 1998 (wedges). Forsyth, "Comparison of VIPM Methods", Game Programming Gems 2, 2001 (one vertex and one
//   index buffer, edited in place). Kuzikowski, Belago, Gladky, Elykov, "Hardware Friendly Continuous Level of
//   Details", Graphicon 2005 (tswap).
//
// Level 0 is full detail; ecol i leads from level i to level i + 1, vsplit i back. The wedges of every level are a
// prefix of the vertex buffer: ecol i removes the last ecols[i].wedges of them.
//
// Every order is played by the same three moves. An ecol rewrites corners of the index buffer, each from a removed
// wedge to its parent; a vsplit writes the removed wedge back; a *keyframe* permutes slots (tswap) and shortens the
// range that is drawn. A face that dies is left as a degenerate triangle until a keyframe moves it behind the drawn
// range, or, in the classic order, sits last and leaves the range at once.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/chunk_file.h"
#include "base/result.h"
#include "mesh/packed_vertices.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

struct Ecol {
    uint16_t wedges = 0;  // removed from the end of the vertex prefix, >= 1
    uint16_t faces = 0;   // that die
    bool operator==(const Ecol&) const = default;
};
static_assert(sizeof(Ecol) == 4);

// The slots are permuted, and the drawn range shortened, on arriving at `level` from above.
struct Keyframe {
    uint32_t level = 0;         // 1 .. levels - 1, strictly rising
    uint32_t slots_before = 0;  // drawn slots on arriving
    uint32_t slots_after = 0;   // drawn slots from here on
    uint32_t first_cycle = 0;   // into FaceOrder::cycle_lengths; the next keyframe's first is this one's end
    uint32_t first_slot = 0;    // into FaceOrder::cycle_slots, likewise
    bool operator==(const Keyframe&) const = default;
};
static_assert(sizeof(Keyframe) == 20);

// One face order: a permutation stream over the shared collapses.
struct FaceOrder {
    std::string name;
    bool drops_dead = false;            // classic: every ecol shortens the drawn range by the faces that die
    std::span<const uint32_t> indices;  // level 0; three wedges per slot
    std::span<const uint32_t>
        first_corner;  // per removed wedge r (0 = first to go): its corners begin here; one more at the end
    std::span<const uint32_t> corners;  // positions in the index buffer that hold the wedge when it is removed
    std::span<const Keyframe> keyframes;
    std::span<const uint32_t> cycle_lengths;  // >= 2 each
    std::span<const uint32_t> cycle_slots;  // tswap arguments, cycle after cycle: slot f[i] receives what f[i + 1] held

    // Drawn slots at a level with `alive` faces; never rises with the level.
    uint32_t slots_at(uint32_t level, uint32_t alive) const;

    uint64_t permutation_bytes() const {
        return cycle_lengths.size_bytes() + cycle_slots.size_bytes() + keyframes.size_bytes();
    }
    // Slots written by tswaps from full detail to the base, per collapse.
    double moved_per_ecol(size_t collapses) const {
        return collapses ? static_cast<double>(cycle_slots.size()) / static_cast<double>(collapses) : 0;
    }
};

struct ProgressiveMesh {
    std::span<const MeshVertex> vertices;    // per wedge; level L uses the first wedges_at(L)
    std::span<const uint32_t> wedge_vertex;  // per wedge: its vertex, so that seams are known
    std::span<const Ecol> ecols;
    std::span<const uint32_t> parents;  // per removed wedge r (0 = first to go): the wedge it becomes
    std::span<const float> errors;      // per level: object units, never decreasing, errors[0] == 0
    std::vector<FaceOrder> orders;
    PresentAttributes attributes;
    std::vector<Material> material_table;
    std::vector<Image> images;

    uint32_t levels() const { return static_cast<uint32_t>(ecols.size()) + 1; }
    uint32_t full_triangles() const { return orders.empty() ? 0 : static_cast<uint32_t>(orders[0].indices.size() / 3); }
    uint32_t wedges_at(uint32_t level) const { return wedges_at_[level]; }
    uint32_t triangles_at(uint32_t level) const { return triangles_at_[level]; }
    // The removed wedges of ecol i are numbered wedges_at(i + 1) .. wedges_at(i) - 1; r of wedge w is wedges_at(0) - 1
    // - w.

    const FaceOrder* order_named(std::string_view name) const;  // null where there is none

    // The coarsest level whose error is at most `error` (object units); 0 where none is.
    uint32_t level_for_error(double error) const;
    // The finest level of at most this many triangles; the last level where none is.
    uint32_t level_for_triangles(uint64_t triangles) const;

    // Every range and cross-reference; and, by playing every order from full detail to the base and back, that it ends
    // where it began and that every ecol finds what it expects. Fault::invariant names order, level and place.
    Result<void> validate() const;

    // Checked cheaply (ranges, sizes, order of keyframes), without playing: enough that a cursor never leaves its
    // buffers.
    static Result<ProgressiveMesh> open(const ChunkFile& file);
    Result<void> write_chunks(ChunkWriter& writer) const;

    // Replaces the errors: one per level, never decreasing, the first 0.
    void set_errors(std::vector<float> level_errors);

    // Sets the per-level counts from ecols, vertices and orders; called once by whoever fills the spans.
    Result<void> count_levels();
    // What the spans refer to.
    std::shared_ptr<const void> owner;

private:
    std::vector<uint32_t> wedges_at_, triangles_at_;
};

}  // namespace lodestone
