#include "lod/asset/cursor.h"

#include <algorithm>
#include <array>

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

PmSnapshots::PmSnapshots(const ProgressiveMesh& pm, uint32_t order) {
    const FaceOrder& o = pm.orders[order];
    PmCursor cursor(pm, order);
    for (uint32_t k = 0; k <= o.keyframes.size() && !o.keyframes.empty(); ++k) {
        // Levels at which the half that is not drawn holds nothing.
        const uint32_t first = k == 0 ? 0 : o.keyframes[k - 1].level + o.keyframes[k - 1].reach();
        const uint32_t end = k == o.keyframes.size() ? pm.levels() : o.keyframes[k].level - o.keyframes[k].reach();
        if (first >= end) continue;
        const uint32_t level = first + (end - first) / 2;
        cursor.goto_level(level);
        const auto drawn = cursor.drawn_indices();
        snapshots_.push_back({level, k, {drawn.begin(), drawn.end()}});
    }
}

const PmSnapshots::Snapshot* PmSnapshots::nearest(uint32_t level) const {
    const auto above =
        std::ranges::lower_bound(snapshots_, level, {}, [](const Snapshot& snapshot) { return snapshot.level; });
    if (above == snapshots_.begin()) return snapshots_.empty() ? nullptr : &*above;
    const auto below = above - 1;
    return above == snapshots_.end() || level - below->level <= above->level - level ? &*below : &*above;
}

PmCursor::PmCursor(const ProgressiveMesh& pm, uint32_t order) : pm_(&pm), order_(order) {
    LODE_CHECK(order < pm.orders.size(), order, pm.orders.size());
    const FaceOrder& o = pm.orders[order];
    indices_.assign(o.indices.begin(), o.indices.end());
    first_half_ = static_cast<uint32_t>(indices_.size());
    half_begin_ = {0, first_half_};
    if (!o.keyframes.empty()) indices_.resize(indices_.size() + size_t{o.keyframes[0].slots} * 3);
    slots_ = o.slots_of(0);
    look_at_keyframes();
    touch_all();
}

PmCursor::PmCursor(const PmCursor& other, uint32_t finest) : PmCursor(other) {
    LODE_CHECK(finest == level_, finest, level_);
    finest_ = finest;
    const FaceOrder& o = pm_->orders[order_];
    std::array<uint32_t, 2> size{};  // of either half, in indices
    size[half()] = slots_ * 3;
    if (holds_order_before()) {
        size[1 - half()] = o.slots_of(keyframe_ - 1) * 3;  // ecols still write to what is left of it
    } else if (keyframe_ < o.keyframes.size()) {
        size[1 - half()] = o.slots_of(keyframe_ + 1) * 3;
    }
    std::vector<uint32_t> kept(size_t{size[0]} + size[1]);
    std::copy_n(other.indices_.begin() + other.half_begin_[0], size[0], kept.begin());
    std::copy_n(other.indices_.begin() + other.half_begin_[1], size[1], kept.begin() + size[0]);
    indices_ = std::move(kept);
    half_begin_ = {0, size[0]};
    touch_all();
}

void PmCursor::touch_all() {
    const size_t blocks = indices_.size() / dirty_block + 1;
    dirty_.assign(blocks / 64 + 1, 0);
    for (size_t b = 0; b < blocks; ++b) touch(static_cast<uint32_t>(b * dirty_block));
}

inline void PmCursor::mark(uint32_t position) {
    const uint32_t block = position / dirty_block;
    dirty_[block / 64] |= uint64_t{1} << (block % 64);
}

inline void PmCursor::touch(uint32_t position) {
    mark(position);
    const uint32_t block = position / dirty_block;
    dirty_low_ = std::min(dirty_low_, block);
    dirty_high_ = std::max(dirty_high_, block);
}

void PmCursor::touch_range(uint32_t first, uint32_t count) {
    if (count == 0) return;
    for (uint64_t position = first; position < uint64_t{first} + count; position += dirty_block)
        touch(static_cast<uint32_t>(position));
    touch(first + count - 1);
}

void PmCursor::apply(const TswapStep& step, bool forward) {
    const FaceOrder& order = pm_->orders[order_];
    const auto* next = &step + 1;
    const bool last = next == order.tswaps.data() + order.tswaps.size();
    const size_t end_cycle = last ? order.cycle_lengths.size() : next->first_cycle;
    size_t slot = step.first_slot;
    uint32_t low = ~0u, high = 0;  // slots
    for (size_t c = step.first_cycle; c < end_cycle; ++c) {
        const auto slots = order.cycle_slots.subspan(slot, order.cycle_lengths[c]);
        if (forward) {
            tswap(indices_, slots);
        } else {
            tswap_inverse(indices_, slots);
        }
        for (const uint32_t s : slots) {
            mark(s * 3);
            mark(s * 3 + 2);
            low = std::min(low, s);
            high = std::max(high, s);
        }
        slot += slots.size();
    }
    if (low <= high) {
        touch(low * 3);
        touch(high * 3 + 2);
    }
    slots_ = forward ? step.slots_after : step.slots_before;
}

// After the keyframe that is drawn has changed.
void PmCursor::look_at_keyframes() {
    const FaceOrder& order = pm_->orders[order_];
    const uint32_t past_all = pm_->levels() + 1;
    next_begin_ = keyframe_ < order.keyframes.size()
                      ? order.keyframes[keyframe_].level - order.keyframes[keyframe_].reach()
                      : past_all;
    last_end_ = keyframe_ > 0 ? order.keyframes[keyframe_ - 1].level + order.keyframes[keyframe_ - 1].reach() : 0;
}

// Blocks of the order that comes next, from the faces that are drawn.
void PmCursor::build_next(const Keyframe& next, uint32_t first_block, uint32_t end_block) {
    const FaceOrder& order = pm_->orders[order_];
    const uint32_t* from = indices_.data() + half_begin_[half()];
    const uint32_t begin = half_begin_[1 - half()];
    for (uint32_t b = first_block; b < end_block; ++b) {
        const uint32_t first = b * keyframe_block_slots, slots = std::min(keyframe_block_slots, next.slots - first);
        uint32_t* to = indices_.data() + begin + first * 3;
        read_keyframe_block(
            order.block(next.first_block + b).data(), slots,
            [&](uint32_t, uint32_t source) {
                const uint32_t* face = from + size_t{source} * 3;
                *to++ = face[0];
                *to++ = face[1];
                *to++ = face[2];
            },
            [](const DeadFace&) {});
        touch_range(begin + first * 3, slots * 3);
    }
}

// Blocks of the order before the one that is drawn, the dead faces they hold included.
void PmCursor::restore_previous(const Keyframe& drawn, uint32_t first_block, uint32_t end_block) {
    const FaceOrder& order = pm_->orders[order_];
    const uint32_t begin = half_begin_[1 - half()], wedges = vertex_count(), total = pm_->wedges_at(0);
    uint32_t* to = indices_.data() + begin;
    uint32_t low = ~0u, high = 0;
    const auto put = [&](uint32_t slot, uint32_t x, uint32_t y, uint32_t z) {
        uint32_t* face = to + size_t{slot} * 3;
        face[0] = x;
        face[1] = y;
        face[2] = z;
        low = std::min(low, slot);
        high = std::max(high, slot);
        mark(begin + slot * 3);
        mark(begin + slot * 3 + 2);
    };
    for (uint32_t b = first_block; b < end_block; ++b) {
        const uint32_t first = b * keyframe_block_slots, slots = std::min(keyframe_block_slots, drawn.slots - first);
        const uint32_t* from = indices_.data() + half_begin_[half()] + first * 3;
        const uint32_t* next = from;
        read_keyframe_block(
            order.block(drawn.first_block + b).data(), slots,
            [&](uint32_t, uint32_t source) {
                put(source, next[0], next[1], next[2]);
                next += 3;
            },
            [&](const DeadFace& dead) {
                if (!dead.literal) {
                    const uint32_t* face = from + dead.neighbour * 3u;
                    put(dead.slot, face[dead.corners[0]], face[dead.corners[1]], face[dead.corners[2]]);
                    return;
                }
                Slot face = dead.wedges;
                for (uint32_t& wedge : face) {
                    while (wedge >= wedges) wedge = pm_->parents[total - 1 - wedge];
                }
                put(dead.slot, face[0], face[1], face[2]);
            });
    }
    if (low <= high) {
        touch(begin + low * 3);
        touch(begin + high * 3 + 2);
    }
}

// What a keyframe asks for on arriving at level_ from the level above it, its ecol done.
void PmCursor::enter_level_from_above() {
    const FaceOrder& order = pm_->orders[order_];
    if (next_tswap_ < order.tswaps.size() && order.tswaps[next_tswap_].level == level_)
        apply(order.tswaps[next_tswap_++], true);
    if (level_ < next_begin_) return;
    const Keyframe& next = order.keyframes[keyframe_];
    if (level_ < next.level) {
        build_next(next, next.blocks_held(level_ - 1), next.blocks_held(level_));
    } else {
        ++keyframe_;
        slots_ = next.slots;
        look_at_keyframes();
    }
}

// On arriving at level_ from below, its vsplit done.
void PmCursor::enter_level_from_below() {
    if (level_ + 1 > last_end_ || keyframe_ == 0) return;
    const FaceOrder& order = pm_->orders[order_];
    const Keyframe& drawn = order.keyframes[keyframe_ - 1];
    if (level_ >= drawn.level) {
        restore_previous(drawn, drawn.blocks_held(level_ + 1), drawn.blocks_held(level_));
    } else {
        --keyframe_;
        slots_ = order.slots_of(keyframe_);
        look_at_keyframes();
    }
}

bool PmCursor::ecol() {
    if (level_ + 1 >= pm_->levels()) return false;
    const FaceOrder& order = pm_->orders[order_];
    const Ecol step = pm_->ecols[level_];
    const uint32_t total = pm_->wedges_at(0);
    const uint32_t first = total - pm_->wedges_at(level_);  // removed wedges r, ascending: highest wedge first
    for (uint32_t r = first; r < first + step.wedges; ++r) {
        const uint32_t parent = pm_->parents[r];
        for (uint64_t c = order.first_corner[r]; c < order.first_corner[r + 1]; ++c) {
            const uint32_t index = index_of(order.corners[c]);
            indices_[index] = parent;
            touch(index);
        }
    }
    if (order.drops_dead) slots_ -= step.faces;
    ++level_;
    enter_level_from_above();
    return true;
}

bool PmCursor::vsplit() {
    if (level_ <= finest_) return false;
    const FaceOrder& order = pm_->orders[order_];
    if (next_tswap_ > 0 && order.tswaps[next_tswap_ - 1].level == level_) apply(order.tswaps[--next_tswap_], false);
    --level_;
    const Ecol step = pm_->ecols[level_];
    if (order.drops_dead) slots_ += step.faces;
    const uint32_t total = pm_->wedges_at(0);
    const uint32_t first = total - pm_->wedges_at(level_);
    for (uint32_t r = first; r < first + step.wedges; ++r) {
        const uint32_t wedge = total - 1 - r;
        for (uint64_t c = order.first_corner[r]; c < order.first_corner[r + 1]; ++c) {
            const uint32_t index = index_of(order.corners[c]);
            indices_[index] = wedge;
            touch(index);
        }
    }
    enter_level_from_below();
    return true;
}

void PmCursor::jump(const PmSnapshots::Snapshot& snapshot) {
    level_ = snapshot.level;
    keyframe_ = snapshot.keyframe;
    slots_ = static_cast<uint32_t>(snapshot.indices.size() / 3);
    look_at_keyframes();
    std::ranges::copy(snapshot.indices, indices_.begin() + half_begin_[half()]);
    touch_range(half_begin_[half()], slots_ * 3);
}

void PmCursor::goto_level(uint32_t level) {
    LODE_CHECK(level >= finest_ && level < pm_->levels(), level, finest_, pm_->levels());
    if (snapshots_ != nullptr) {
        // A step costs about as much as copying a few slots; a jump, the copy and the walk that is left.
        constexpr uint64_t slots_per_step = 24;
        const auto walk = [&](uint32_t from) { return slots_per_step * (from < level ? level - from : from - level); };
        const PmSnapshots::Snapshot* nearest = snapshots_->nearest(level);
        if (nearest != nullptr && nearest->level >= finest_ &&
            nearest->indices.size() / 3 + walk(nearest->level) < walk(level_)) {
            jump(*nearest);
        }
    }
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
        const Slot face = face_at(drawn_indices(), slot);
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
    TriMesh mesh = unpack_vertices(pm.vertices.first(wedges), pm.further.first(pm.further.empty() ? 0 : wedges),
                                   pm.wedge_vertex.first(wedges), pm.attributes);
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

Result<TriMesh> extract_level(const ProgressiveMesh& pm, uint32_t level, uint32_t order) {
    PmCursor cursor(pm, order);
    cursor.goto_level(level);
    if (auto good = cursor.validate(); !good)
        return fail(Fault::format, good.error().message + "; bake the asset again");
    return mesh_of(cursor);
}

}  // namespace lodestone
