// A place in a progressive mesh: one index buffer at one level, moved by vsplit, ecol and tswap (the sequence and
// CurNumVerts / CurNumTris of Kuzikowski et al. 2005, section 4; next, prev and goto are Hoppe's names).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lod/progressive_mesh.h"

namespace lodestone {

// tswap: slot f[0] receives the face of f[1], f[1] that of f[2], ..., the last that of f[0]. indices: three per slot.
void tswap(std::span<uint32_t> indices, std::span<const uint32_t> slots);
// Its inverse over the same slots: the cycle run backwards.
void tswap_inverse(std::span<uint32_t> indices, std::span<const uint32_t> slots);

// Indices [first, first + count) of the index buffer.
struct IndexRange {
    uint32_t first = 0, count = 0;
    bool operator==(const IndexRange&) const = default;
};

class PmCursor {
public:
    // Starts at full detail. `pm` must outlive the cursor; order is a position in pm.orders.
    explicit PmCursor(const ProgressiveMesh& pm, uint32_t order = 0);

    // A copy of `other` that never goes finer than `finest` (other must not be finer) and keeps only the slots that
    // needs.
    PmCursor(const PmCursor& other, uint32_t finest);

    uint32_t level() const { return level_; }
    uint32_t finest_level() const { return finest_; }
    uint64_t cpu_bytes() const { return indices_.size() * 4 + dirty_.size() * 8; }
    uint32_t vertex_count() const { return pm_->wedges_at(level_); }       // CurNumVerts
    uint32_t triangle_count() const { return pm_->triangles_at(level_); }  // CurNumTris: alive ones
    uint32_t slot_count() const { return slots_; }                         // drawn ones, degenerate included
    std::span<const uint32_t> drawn_indices() const { return std::span(indices_).first(size_t{slots_} * 3); }
    // The whole buffer, slots behind the drawn range included: equal on the way down and up at every level.
    std::span<const uint32_t> all_indices() const { return indices_; }
    const ProgressiveMesh& mesh() const { return *pm_; }
    uint32_t order() const { return order_; }

    bool ecol();    // one level coarser; false at the base
    bool vsplit();  // one level finer; false at finest_level()
    // Cost linear in the distance; nothing when the level stays. level: finest_level() .. pm.levels() - 1.
    void goto_level(uint32_t level);

    // Pieces of the index buffer written since the last call (whole blocks of dirty_block indices), merged where they
    // touch, ascending. The first call after construction returns the drawn range.
    static constexpr uint32_t dirty_block = 256;
    std::vector<IndexRange> take_dirty();

    // Every index of the drawn range below vertex_count(), alive faces as many as they should be.
    Result<void> validate() const;

private:
    void touch(uint32_t position);
    void touch_all();
    void apply(const Keyframe& keyframe, bool forward);

    const ProgressiveMesh* pm_;
    uint32_t order_;
    uint32_t level_ = 0, finest_ = 0;
    uint32_t slots_ = 0;
    uint32_t next_keyframe_ = 0;  // the first whose level is > level_
    std::vector<uint32_t> indices_;
    std::vector<uint64_t> dirty_;                // a bit per block
    uint32_t dirty_low_ = ~0u, dirty_high_ = 0;  // blocks, so that a short walk costs no long scan
};

// The level a cursor is at as a mesh: the faces of the drawn range in drawing order, degenerate ones left out, wedges
// and vertices kept.
TriMesh mesh_of(const PmCursor& cursor);
TriMesh extract_level(const ProgressiveMesh& pm, uint32_t level, uint32_t order = 0);

}  // namespace lodestone
