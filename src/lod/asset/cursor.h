// A place in a progressive mesh: one index buffer at one level, moved by vsplit, ecol and tswap (the sequence and
// CurNumVerts / CurNumTris of Kuzikowski et al. 2005, section 4; next, prev and goto are Hoppe's names).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lod/asset/progressive_mesh.h"

namespace lodestone {

// A cyclic permutation of slots: slot f[0] receives the face of f[1], f[1] that of f[2], ..., the last that of f[0].
// indices: three per slot.
void tswap(std::span<uint32_t> indices, std::span<const uint32_t> slots);
// Its inverse over the same slots: the cycle run backwards.
void tswap_inverse(std::span<uint32_t> indices, std::span<const uint32_t> slots);

// Indices [first, first + count) of the index buffer.
struct IndexRange {
    uint32_t first = 0, count = 0;  // in indices, not bytes
    bool operator==(const IndexRange&) const = default;
};

// Index buffers of levels in the middle of the intervals between keyframes, so that a cursor may jump: going to any
// level then costs a copy of about its index buffer and a walk of half an interval at most. Shared by all cursors of an
// order; 12 bytes per slot of every keyframe.
class PmSnapshots {
public:
    // Walks through all levels once. Without keyframes there are no snapshots.
    PmSnapshots(const ProgressiveMesh& pm, uint32_t order);
    // The index buffer of a level.
    struct Snapshot {
        uint32_t level = 0, keyframe = 0;  // keyframe: the one that is drawn there, 0 for full detail
        std::vector<uint32_t> indices;     // drawn
    };
    // The nearest to a level; null where there are none.
    const Snapshot* nearest(uint32_t level) const;

private:
    std::vector<Snapshot> snapshots_;  // by rising level
};

// A place in one order of a mesh, and its index buffer. One thread moves it at a time.
class PmCursor {
public:
    // Starts at full detail. `pm` must outlive the cursor; order is a position in pm.orders.
    explicit PmCursor(const ProgressiveMesh& pm, uint32_t order = 0);

    // A copy of `other` that never goes finer than `finest` (other must be at that level) and keeps only the slots that
    // needs.
    PmCursor(const PmCursor& other, uint32_t finest);

    // Lets goto_level jump. Must be of the same mesh and order.
    void use(std::shared_ptr<const PmSnapshots> snapshots) { snapshots_ = std::move(snapshots); }

    uint32_t level() const { return level_; }          // where it is, 0 for full detail
    uint32_t finest_level() const { return finest_; }  // it never goes finer; 0 unless it is a limited copy
    uint32_t vertex_count() const { return pm_->wedges_at(level_); }       // CurNumVerts
    uint32_t triangle_count() const { return pm_->triangles_at(level_); }  // CurNumTris: alive ones
    uint32_t slot_count() const { return slots_; }                         // drawn ones, degenerate included
    // What is drawn, as a part of all_indices().
    IndexRange drawn() const { return {half_begin_[half()], slots_ * 3}; }
    // What is drawn, three wedges per slot. Valid until the cursor moves.
    std::span<const uint32_t> drawn_indices() const {
        return std::span(indices_).subspan(half_begin_[half()], size_t{slots_} * 3);
    }
    // The whole buffer, both halves; what is neither drawn nor on its way in or out is of no meaning.
    std::span<const uint32_t> all_indices() const { return indices_; }
    // The wedge at a place of FaceOrder::corners.
    uint32_t at(uint32_t place) const { return indices_[index_of(place)]; }
    // Whether the half that is not drawn still holds some of the order before; a limited copy is then larger.
    bool holds_order_before() const { return keyframe_ > 0 && level_ < last_end_; }
    const ProgressiveMesh& mesh() const { return *pm_; }  // as given
    uint32_t order() const { return order_; }             // into ProgressiveMesh::orders

    bool ecol();    // one level coarser; false at the base
    bool vsplit();  // one level finer; false at finest_level()
    // Cost linear in the distance, or that of a jump where it is less; nothing when the level stays.
    // level: finest_level() .. pm.levels() - 1.
    void goto_level(uint32_t level);

    static constexpr uint32_t dirty_block = 256;  // indices that are told of together
    // Pieces of the index buffer written since the last call (whole blocks of dirty_block indices), merged where they
    // touch, ascending. The first call after construction returns the drawn range.
    std::vector<IndexRange> take_dirty();

    // Every index of the drawn range below vertex_count(), alive faces as many as they should be.
    Result<void> validate() const;

private:
    uint32_t half() const { return keyframe_ & 1; }
    // A limited copy has less room in the first half.
    uint32_t index_of(uint32_t place) const {
        return place < first_half_ ? place : place - first_half_ + half_begin_[1];
    }
    void mark(uint32_t position);   // its block is dirty
    void touch(uint32_t position);  // and within the blocks looked at
    void touch_range(uint32_t first, uint32_t count);
    void touch_all();
    void apply(const TswapStep& step, bool forward);
    void look_at_keyframes();
    void enter_level_from_above();
    void enter_level_from_below();
    void build_next(const Keyframe& next, uint32_t first_block, uint32_t end_block);
    void restore_previous(const Keyframe& drawn, uint32_t first_block, uint32_t end_block);
    void jump(const PmSnapshots::Snapshot& snapshot);

    const ProgressiveMesh* pm_;
    uint32_t order_;
    uint32_t level_ = 0, finest_ = 0;
    uint32_t slots_ = 0;
    uint32_t next_tswap_ = 0;  // the first whose level is > level_
    uint32_t keyframe_ = 0;    // the one that is drawn, 0 for full detail
    // Levels from which on, and down to which, a step has to look at keyframes; between them it need not.
    uint32_t next_begin_ = 0, last_end_ = 0;
    uint32_t first_half_ = 0;  // indices of full detail
    std::array<uint32_t, 2> half_begin_{};
    std::vector<uint32_t> indices_;
    std::vector<uint64_t> dirty_;                // a bit per block
    uint32_t dirty_low_ = ~0u, dirty_high_ = 0;  // blocks, so that a short walk costs no long scan
    std::shared_ptr<const PmSnapshots> snapshots_;
};

// The level a cursor is at as a mesh: the faces of the drawn range in drawing order, degenerate ones left out, wedges
// and vertices kept.
// The cursor must be valid (PmCursor::validate).
TriMesh mesh_of(const PmCursor& cursor);
// The same of a level without a cursor. Fault::format where the level is none: what ProgressiveMesh::open lets pass may
// still not play.
Result<TriMesh> extract_level(const ProgressiveMesh& pm, uint32_t level, uint32_t order = 0);

}  // namespace lodestone
