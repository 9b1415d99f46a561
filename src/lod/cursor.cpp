#include "lod/cursor.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/check.h"

namespace lodestone {

namespace {
using Slot = std::array<uint32_t, 3>;

Slot face_at(std::span<const uint32_t> indices, uint32_t slot) {
    const size_t at = size_t{slot} * 3;
    return {indices[at], indices[at + 1], indices[at + 2]};
}
void put_face(std::span<uint32_t> indices, uint32_t slot, const Slot& face) {
    std::copy(face.begin(), face.end(), indices.begin() + static_cast<ptrdiff_t>(size_t{slot} * 3));
}
}  // namespace

void tswap(std::span<uint32_t> indices, std::span<const uint32_t> slots) {
    const Slot first = face_at(indices, slots.front());
    for (size_t i = 0; i + 1 < slots.size(); ++i) put_face(indices, slots[i], face_at(indices, slots[i + 1]));
    put_face(indices, slots.back(), first);
}

void tswap_inverse(std::span<uint32_t> indices, std::span<const uint32_t> slots) {
    const Slot last = face_at(indices, slots.back());
    for (size_t i = slots.size() - 1; i > 0; --i) put_face(indices, slots[i], face_at(indices, slots[i - 1]));
    put_face(indices, slots.front(), last);
}

PmCursor::PmCursor(const ProgressiveMesh& pm, uint32_t order) : pm_(&pm), order_(order) {
    LODE_CHECK(order < pm.orders.size(), order, pm.orders.size());
    const FaceOrder& o = pm.orders[order];
    indices_.assign(o.indices.begin(), o.indices.end());
    slots_ = static_cast<uint32_t>(indices_.size() / 3);
    touch_all();
}

PmCursor::PmCursor(const PmCursor& other, uint32_t finest) : PmCursor(other) {
    LODE_CHECK(finest <= level_, finest, level_);
    finest_ = finest;
    indices_.resize(size_t{pm_->orders[order_].slots_at(finest, pm_->triangles_at(finest))} * 3);
    indices_.shrink_to_fit();
    touch_all();
}

void PmCursor::touch_all() {
    const size_t blocks = indices_.size() / dirty_block + 1;
    dirty_.assign(blocks / 64 + 1, 0);
    for (size_t b = 0; b < blocks; ++b) touch(static_cast<uint32_t>(b * dirty_block));
}

inline void PmCursor::touch(uint32_t position) {
    const uint32_t block = position / dirty_block;
    dirty_[block / 64] |= uint64_t{1} << (block % 64);
    dirty_low_ = std::min(dirty_low_, block);
    dirty_high_ = std::max(dirty_high_, block);
}

void PmCursor::apply(const Keyframe& keyframe, bool forward) {
    const FaceOrder& order = pm_->orders[order_];
    const auto* next = &keyframe + 1;
    const bool last = next == order.keyframes.data() + order.keyframes.size();
    const size_t end_cycle = last ? order.cycle_lengths.size() : next->first_cycle;
    size_t slot = keyframe.first_slot;
    uint32_t low = ~0u, high = 0;  // slots: a keyframe moves nearly all faces, so all between is taken as written
    for (size_t c = keyframe.first_cycle; c < end_cycle; ++c) {
        const auto slots = order.cycle_slots.subspan(slot, order.cycle_lengths[c]);
        if (forward) {
            tswap(indices_, slots);
        } else {
            tswap_inverse(indices_, slots);
        }
        for (const uint32_t s : slots) {
            low = std::min(low, s);
            high = std::max(high, s);
        }
        slot += slots.size();
    }
    if (low <= high) {
        for (uint32_t position = low * 3; position <= high * 3 + 2; position += dirty_block) touch(position);
        touch(high * 3 + 2);
    }
    slots_ = forward ? keyframe.slots_after : keyframe.slots_before;
}

bool PmCursor::ecol() {
    if (level_ + 1 >= pm_->levels()) return false;
    const FaceOrder& order = pm_->orders[order_];
    const Ecol step = pm_->ecols[level_];
    const uint32_t total = pm_->wedges_at(0);
    const uint32_t first = total - pm_->wedges_at(level_);  // removed wedges r, ascending: highest wedge first
    for (uint32_t r = first; r < first + step.wedges; ++r) {
        const uint32_t parent = pm_->parents[r];
        for (uint32_t c = order.first_corner[r]; c < order.first_corner[r + 1]; ++c) {
            indices_[order.corners[c]] = parent;
            touch(order.corners[c]);
        }
    }
    if (order.drops_dead) slots_ -= step.faces;
    ++level_;
    if (next_keyframe_ < order.keyframes.size() && order.keyframes[next_keyframe_].level == level_) {
        apply(order.keyframes[next_keyframe_++], true);
    }
    return true;
}

bool PmCursor::vsplit() {
    if (level_ <= finest_) return false;
    const FaceOrder& order = pm_->orders[order_];
    if (next_keyframe_ > 0 && order.keyframes[next_keyframe_ - 1].level == level_) {
        apply(order.keyframes[--next_keyframe_], false);
    }
    --level_;
    const Ecol step = pm_->ecols[level_];
    if (order.drops_dead) slots_ += step.faces;
    const uint32_t total = pm_->wedges_at(0);
    const uint32_t first = total - pm_->wedges_at(level_);
    for (uint32_t r = first; r < first + step.wedges; ++r) {
        const uint32_t wedge = total - 1 - r;
        for (uint32_t c = order.first_corner[r]; c < order.first_corner[r + 1]; ++c) {
            indices_[order.corners[c]] = wedge;
            touch(order.corners[c]);
        }
    }
    return true;
}

void PmCursor::goto_level(uint32_t level) {
    LODE_CHECK(level >= finest_ && level < pm_->levels(), level, finest_, pm_->levels());
    while (level_ < level) ecol();
    while (level_ > level) vsplit();
}

std::vector<IndexRange> PmCursor::take_dirty() {
    std::vector<IndexRange> ranges;
    if (dirty_low_ > dirty_high_) return ranges;
    const auto size = static_cast<uint32_t>(indices_.size());
    for (uint32_t block = dirty_low_; block <= dirty_high_; ++block) {
        if (dirty_[block / 64] == 0) {
            block |= 63;  // on to the next word
            continue;
        }
        if ((dirty_[block / 64] >> (block % 64) & 1) == 0) continue;
        const uint32_t first = block * dirty_block;
        if (first >= size) break;
        const uint32_t count = std::min(dirty_block, size - first);
        if (!ranges.empty() && ranges.back().first + ranges.back().count == first) {
            ranges.back().count += count;
        } else {
            ranges.push_back({first, count});
        }
    }
    for (uint32_t word = dirty_low_ / 64; word <= dirty_high_ / 64; ++word) dirty_[word] = 0;
    dirty_low_ = ~0u;
    dirty_high_ = 0;
    return ranges;
}

Result<void> PmCursor::validate() const {
    const auto wrong = [&](const std::string& what) {
        return fail(Fault::invariant,
                    "order " + pm_->orders[order_].name + ", level " + std::to_string(level_) + ": " + what);
    };
    uint32_t alive = 0;
    const uint32_t wedges = vertex_count();
    for (uint32_t slot = 0; slot < slots_; ++slot) {
        const Slot face = face_at(indices_, slot);
        for (const uint32_t wedge : face) {
            if (wedge >= wedges) return wrong("slot " + std::to_string(slot) + " uses a wedge that is not active");
        }
        alive += face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
    }
    if (alive != triangle_count()) {
        return wrong(std::to_string(alive) + " faces are alive where " + std::to_string(triangle_count()) +
                     " should be");
    }
    return {};
}

TriMesh mesh_of(const PmCursor& cursor) {
    const ProgressiveMesh& pm = cursor.mesh();
    const size_t wedges = cursor.vertex_count();
    TriMesh mesh = unpack_vertices(pm.vertices.first(wedges), pm.wedge_vertex.first(wedges), pm.attributes);
    mesh.material_table = pm.material_table;
    mesh.images = pm.images;
    const auto indices = cursor.drawn_indices();
    for (size_t i = 0; i < indices.size(); i += 3) {
        const Triangle t = {indices[i], indices[i + 1], indices[i + 2]};
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
    }
    drop_unreferenced(mesh);
    return mesh;
}

TriMesh extract_level(const ProgressiveMesh& pm, uint32_t level, uint32_t order) {
    PmCursor cursor(pm, order);
    cursor.goto_level(level);
    return mesh_of(cursor);
}

}  // namespace lodestone
