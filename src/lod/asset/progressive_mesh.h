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
// Every order is played by the same moves. An ecol rewrites corners of the index buffer, each from a removed wedge to
// its parent; a vsplit writes the removed wedge back. A face that dies is left as a degenerate triangle, or, in the
// classic order, sits last and leaves the drawn range at once. The order of the faces changes in one of two ways:
//   - tswaps, the seed's: cyclic permutations of slots, in place, at the level where they are noted;
//   - keyframes: a new order of the faces alive at a level. The index buffer has two halves, and while one is drawn the
//     next order is made up in the other, some blocks at each ecol before the keyframe, from the faces drawn; on the
//     way back the order before is brought back likewise, some blocks at each vsplit after it. At the keyframe the
//     halves change places, and no step pays for a whole reorder.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/files/chunk_file.h"
#include "base/result.h"
#include "lod/asset/keyframe_blocks.h"
#include "mesh/packed_vertices.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Raised whenever what a progressive mesh stores, or what it means, is no longer what it was; others are refused.
// 2: errors rise strictly from level to level, each measured. 3: packed, from coarse to fine. 4: second texture
// coordinates. 5: tangents.
inline constexpr int progressive_mesh_version = 5;

// How much one edge collapse takes away.
struct Ecol {
    uint16_t wedges = 0;  // removed from the end of the vertex prefix, >= 1
    uint16_t faces = 0;   // that die
    bool operator==(const Ecol&) const = default;
};
static_assert(sizeof(Ecol) == 4);

// Slots are permuted in place, and the drawn range shortened, on arriving at `level` from above.
struct TswapStep {
    uint32_t level = 0;         // 1 .. levels - 1, strictly rising
    uint32_t slots_before = 0;  // drawn slots on arriving
    uint32_t slots_after = 0;   // drawn slots from here on
    uint32_t first_cycle = 0;   // into FaceOrder::cycle_lengths; the next step's first is this one's end
    uint32_t first_slot = 0;    // into FaceOrder::cycle_slots, likewise
    bool operator==(const TswapStep&) const = default;
};
static_assert(sizeof(TswapStep) == 20);

// A new order is drawn from `level` on. Keyframe k (from 1 on) is drawn from half k % 2 of the index buffer, full
// detail from half 0.
struct Keyframe {
    uint32_t level = 0;            // 2 .. levels - 1, rising by at least 2
    uint32_t slots = 0;            // drawn slots, all alive at `level`
    uint32_t dead = 0;             // faces of the order before that are not in this one
    uint32_t first_block = 0;      // into FaceOrder::block_ends; ceil(slots / 64) blocks
    uint32_t blocks_per_step = 1;  // written by an ecol close before `level`, or a vsplit close behind it
    bool operator==(const Keyframe&) const = default;

    // That the order consists of, the last perhaps not full; slots > 0.
    uint32_t blocks() const { return (slots - 1) / keyframe_block_slots + 1; }
    // Levels before `level`, and from it on, at which the half that is not drawn holds something.
    // blocks_per_step > 0.
    uint32_t reach() const { return (blocks() - 1) / blocks_per_step + 1; }
    // Blocks that the half that is not drawn holds at a level: of this order before `level`, of the order before from
    // it on.
    uint32_t blocks_held(uint32_t at) const {
        const uint64_t distance = at < level ? level - 1 - at : at - level;
        const uint64_t missing = distance * blocks_per_step;
        return missing < blocks() ? blocks() - static_cast<uint32_t>(missing) : 0;
    }
};
static_assert(sizeof(Keyframe) == 20);

// One face order: a permutation stream over the shared collapses.
struct FaceOrder {
    std::string name;                   // as face_orderer_named() knows it
    bool searched_less = false;         // just baked, and OrderOptions::seconds was too little for a whole search
    bool drops_dead = false;            // classic: every ecol shortens the drawn range by the faces that die
    std::span<const uint32_t> indices;  // level 0; three wedges per slot
    std::span<const uint64_t>
        first_corner;  // per removed wedge r (0 = first to go): its corners begin here; one more at the end
    // Where the wedge is when it is removed, and where it comes when it returns: places in the index buffer, whose
    // second half begins behind the indices of full detail (half_of, position_of).
    std::span<const uint32_t> corners;
    std::span<const TswapStep> tswaps;        // by rising level; none where there are keyframes
    std::span<const uint32_t> cycle_lengths;  // >= 2 each
    std::span<const uint32_t> cycle_slots;  // tswap arguments, cycle after cycle: slot f[i] receives what f[i + 1] held
    std::span<const Keyframe> keyframes;    // none where there are tswaps
    std::span<const uint64_t> block_ends;   // per block of all keyframes: its end in block_bytes
    std::span<const uint8_t> block_bytes;   // keyframe_blocks.h

    // Drawn slots at a level with `alive` faces; never rises with the level.
    uint32_t slots_at(uint32_t level, uint32_t alive) const;
    // Keyframes at or above a level: the number of the one that is drawn, 0 for full detail's order.
    uint32_t keyframe_at(uint32_t level) const;
    // Slots of keyframe k, k = 0 for full detail.
    uint32_t slots_of(uint32_t k) const {
        return k == 0 ? static_cast<uint32_t>(indices.size() / 3) : keyframes[k - 1].slots;
    }
    // The half of the index buffer that a place is in, 0 or 1.
    uint32_t half_of(uint32_t place) const { return place < indices.size() ? 0 : 1; }
    // Where in its half a place is: slot * 3 + corner.
    uint32_t position_of(uint32_t place) const {
        return half_of(place) == 0 ? place : place - static_cast<uint32_t>(indices.size());
    }
    // The bytes of a block, numbered through all keyframes.
    std::span<const uint8_t> block(uint32_t b) const {
        const uint64_t begin = b == 0 ? 0 : block_ends[b - 1];
        return block_bytes.subspan(begin, block_ends[b] - begin);
    }

    // Size of what changes the order, tswaps and keyframes; bytes.
    uint64_t permutation_bytes() const {
        return cycle_lengths.size_bytes() + cycle_slots.size_bytes() + tswaps.size_bytes() + keyframes.size_bytes() +
               block_ends.size_bytes() + block_bytes.size_bytes();
    }
    // Slots written by tswaps and keyframes from full detail to the base, per collapse. The way back writes as many,
    // and brings each face that died back once.
    double moved_per_ecol(size_t collapses) const;
};

class StoredMesh;  // stored_mesh.h

// Bytes of a progressive mesh in its file, by what they tell.
struct StoredParts {
    uint64_t connectivity = 0;                                                  // splits and corners
    uint64_t vertices = 0;                                                      // positions and attributes
    uint64_t orders = 0;                                                        // faces slot by slot, and tswaps
    uint64_t errors = 0;                                                        // of levels
    uint64_t all() const { return connectivity + vertices + orders + errors; }  // together
};

// The mesh as it is played. Copies share what the spans refer to.
struct ProgressiveMesh {
    std::span<const MeshVertex> vertices;        // per wedge; level L uses the first wedges_at(L)
    std::span<const FurtherAttributes> further;  // likewise, or none
    std::span<const uint32_t> wedge_vertex;      // per wedge: its vertex, so that seams are known
    std::span<const Ecol> ecols;                 // one from each level to the next coarser one
    std::span<const uint32_t> parents;           // per removed wedge r (0 = first to go): the wedge it becomes
    std::span<const float> errors;  // per level: object units, never decreasing; errors[0] == 0 where none is missing
    std::vector<FaceOrder> orders;  // at least one; all play the same collapses
    PresentAttributes attributes;   // that the source had
    std::vector<Material> material_table;  // what materials of vertices refer to; empty where the source has none
    std::vector<Image> images;             // what materials refer to
    // Of a file whose end is missing: how many levels are finer than those that are there. Level 0 is then the finest
    // that is there, and in the whole file it has this number.
    uint32_t levels_missing = 0;
    StoredParts parts;  // of what is there

    uint32_t levels() const { return static_cast<uint32_t>(ecols.size()) + 1; }  // at least 1
    // Triangles of full detail.
    uint32_t full_triangles() const { return orders.empty() ? 0 : static_cast<uint32_t>(orders[0].indices.size() / 3); }
    uint32_t wedges_at(uint32_t level) const { return wedges_at_[level]; }        // what the level draws from
    uint32_t triangles_at(uint32_t level) const { return triangles_at_[level]; }  // alive ones
    // The removed wedges of ecol i are numbered wedges_at(i + 1) .. wedges_at(i) - 1; r of wedge w is wedges_at(0) - 1
    // - w.

    const FaceOrder* order_named(std::string_view name) const;  // null where there is none

    // The coarsest level whose error is at most `error` (object units); 0 where none is.
    uint32_t level_for_error(double error) const;
    // The finest level of at most this many wedges; the last level where none is.
    uint32_t level_for_wedges(uint64_t wedges) const;
    // The finest level of at most this many triangles; the last level where none is.
    uint32_t level_for_triangles(uint64_t triangles) const;

    // Every range and cross-reference; and, by playing every order from full detail to the base and back, that it ends
    // where it began and that every ecol finds what it expects. Fault::invariant names order, level and place.
    Result<void> validate() const;

    // The mesh that a StoredMesh tells of, without materials; errors are 0. Fault::format where it tells of none.
    static Result<ProgressiveMesh> unpack(std::shared_ptr<const StoredMesh> stored);
    // The mesh that write_chunks() wrote. Of a file whose end is missing the levels that are there. What it plays is
    // checked cheaply (ranges, sizes, order of keyframes): enough that a cursor never leaves its buffers.
    static Result<ProgressiveMesh> open(const ChunkFile& file);
    // Adds the chunks lod/mesh, lod/table and lod/blocks, and the materials before them. What is written is what was
    // unpacked, and the errors. Fault::machine where they cannot be written.
    Result<void> write_chunks(ChunkWriter& writer) const;

    // Replaces the errors: one per level, never decreasing, the first 0.
    void set_errors(std::vector<float> level_errors);

    // Whether these can be the errors: one per level, never decreasing, from 0 on where no level is missing.
    Result<void> check_errors(std::span<const float> level_errors) const;

    // Sets the per-level counts from ecols, vertices and orders; called once by whoever fills the spans.
    Result<void> count_levels();
    // What the spans refer to.
    std::shared_ptr<const void> owner;
    // What it was unpacked from; never null but where the spans were filled by hand.
    std::shared_ptr<const StoredMesh> stored;

private:
    Result<void> count_shared();  // without a look at what the orders play

    std::vector<uint32_t> wedges_at_, triangles_at_;
};

}  // namespace lodestone
