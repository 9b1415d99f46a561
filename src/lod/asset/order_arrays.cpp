#include "lod/asset/order_arrays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <optional>
#include <utility>

#include "base/check.h"
#include "base/none.h"
#include "lod/asset/replay.h"
#include "mesh/limits.h"

namespace lodestone {

namespace {

// A keyframe reaches over this part of an interval, before it and behind it; at least 2.
constexpr uint32_t reach_share = 8;

// Plays the collapses from fine to coarse. What lives and holds the removed vertex is the arc of its split; what is
// dead is kept in lists, by the wedge that it holds.
class Expansion {
public:
    Expansion(const PlayedMesh& mesh, const PlannedOrder& order)
        : mesh_(mesh), order_(order), levels_(static_cast<uint32_t>(mesh.ecols.size()) + 1) {}

    Result<OrderArrays> run() {
        plan_reaches();
        const uint64_t second = made_.keyframes.empty() ? 0 : made_.keyframes[0].slots;
        if (const uint64_t all = mesh_.indices.size() + 3 * second; all > Limits{}.lod_indices)
            return fail(Fault::format,
                        "order " + order_.name + " " + over_limit("indices in both halves", all, Limits{}.lod_indices));
        begin();
        uint32_t wedges = mesh_.wedges, faces = static_cast<uint32_t>(mesh_.indices.size() / 3);
        for (uint32_t level = 0; level < levels_; ++level) {
            if (drawn_ < made_.keyframes.size() && made_.keyframes[drawn_].level == level) enter_keyframe();
            if (level + 1 == levels_) break;
            play(level, wedges, faces);
            wedges -= mesh_.ecols[level].wedges;
            faces -= mesh_.ecols[level].faces;
        }
        made_.first_corner.push_back(made_.corners.size());
        return std::move(made_);
    }

private:
    uint32_t level_of(uint32_t k) const { return k < order_.orders.size() ? order_.orders[k].level : levels_; }

    // Reaches: short, for while two orders are held a collapse is noted in both; but so long that a step writes few
    // blocks, and never so long that two meet.
    void plan_reaches() {
        for (uint32_t k = 1; k < order_.orders.size(); ++k) {
            const uint32_t before = level_of(k) - level_of(k - 1);
            const uint32_t after = (k + 1 < order_.orders.size() ? level_of(k + 1) : levels_ + 1) - level_of(k);
            const uint32_t reach = std::max(1u, (std::min(before, after) - 1) / reach_share);
            Keyframe key;
            key.level = level_of(k);
            key.slots = static_cast<uint32_t>(order_.orders[k].faces.size());
            key.dead = static_cast<uint32_t>(order_.orders[k - 1].faces.size()) - key.slots;
            key.blocks_per_step = (key.blocks() + reach - 1) / reach;
            made_.keyframes.push_back(key);
        }
    }

    void begin() {
        now_ = std::make_unique_for_overwrite<uint32_t[]>(mesh_.indices.size());
        std::ranges::copy(mesh_.indices, now_.get());
        made_.indices.reserve(mesh_.indices.size());
        for (const uint32_t face : order_.orders[0].faces) {
            const uint32_t* corners = &now_[size_t{face} * 3];
            made_.indices.insert(made_.indices.end(), corners, corners + 3);
        }
        if (!order_.drops_dead) {
            dead_first_.assign(mesh_.wedges, none);
            dead_next_ = std::make_unique_for_overwrite<uint32_t[]>(mesh_.indices.size());
        }
        made_.first_corner.reserve(mesh_.parents.size() + 1);
        made_.corners.reserve((mesh_.arcs.size() + mesh_.indices.size() / 3) * 3 / 2);
        slots_by_face(0, slots_);
        look_ahead();
    }

    void slots_by_face(uint32_t k, std::vector<uint32_t>& slots) const {
        const auto& faces = order_.orders[k].faces;
        slots.resize(faces.size());
        for (uint32_t s = 0; s < faces.size(); ++s) slots[faces[s]] = s;
    }

    // Once an order is drawn: where the next is made, and the last is forgotten.
    void look_ahead() {
        const bool more = drawn_ < made_.keyframes.size();
        if (more) slots_by_face(drawn_ + 1, next_slots_);
        making_from_ = more ? made_.keyframes[drawn_].level - made_.keyframes[drawn_].reach() : levels_;
        forgotten_at_ = drawn_ > 0 ? made_.keyframes[drawn_ - 1].level + made_.keyframes[drawn_ - 1].reach() : 0;
    }

    // A keyframe's blocks, and that it is drawn from now on.
    void enter_keyframe() {
        Keyframe& key = made_.keyframes[drawn_++];
        std::swap(last_slots_, slots_);
        std::swap(slots_, next_slots_);
        // The witness of a dead face that is alive now; found once, and in rising order of faces.
        const auto faces = static_cast<uint32_t>(last_slots_.size());
        witnesses_.resize(key.dead);
        for (uint32_t f = key.slots; f < faces; ++f) {
            const uint32_t older = mesh_.witnesses[f];
            witnesses_[f - key.slots] = older == none || older < key.slots ? older : witnesses_[older - key.slots];
        }
        collect_dead(key);
        write_blocks(key);
        look_ahead();
    }

    // The slot of the order drawn which tells of a face of the order before.
    uint32_t home(uint32_t face) const {
        const auto slots = static_cast<uint32_t>(slots_.size());
        const uint32_t alive = face < slots ? face : witnesses_[face - slots];
        return alive == none ? 0 : slots_[alive];
    }

    // The dead of the order before by the slots that tell of them.
    void collect_dead(const Keyframe& key) {
        told_.assign(key.blocks(), 0);
        told_first_.resize(key.slots);
        told_next_.resize(key.dead);
        for (uint32_t dead = key.dead; dead-- > 0;) {
            const uint32_t slot = home(key.slots + dead);
            uint64_t& block = told_[slot / keyframe_block_slots];
            const uint64_t bit = uint64_t{1} << (slot % keyframe_block_slots);
            told_next_[dead] = (block & bit) != 0 ? told_first_[slot] : none;
            told_first_[slot] = dead;
            block |= bit;
        }
    }

    DeadFace note_dead(uint32_t face, uint32_t alive) const {
        DeadFace noted;
        noted.slot = last_slots_[face];
        noted.literal = alive == none;
        const uint32_t* wedges = &now_[size_t{face} * 3];
        const uint32_t* beside = &now_[size_t{noted.literal ? face : alive} * 3];
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t differ = beside[0] != wedges[k] ? 1 : 0, differs = beside[1] != wedges[k] ? 1 : 0;
            const uint32_t corner = differ * (1 + differs * (1 + (beside[2] != wedges[k] ? 1 : 0)));
            noted.literal |= corner == 3;  // at a seam
            noted.corners[k] = static_cast<uint8_t>(corner);
        }
        if (noted.literal) {
            noted.corners = {};
            std::copy_n(wedges, 3, noted.wedges.begin());
        }
        noted.neighbour = static_cast<uint8_t>((alive == none ? 0 : slots_[alive]) % keyframe_block_slots);
        return noted;
    }

    void write_blocks(Keyframe& key) {
        static_assert(keyframe_block_slots == 64, "told_ has a bit for each");
        key.first_block = static_cast<uint32_t>(made_.block_ends.size());
        const uint32_t* faces = order_.orders[drawn_].faces.data();
        std::array<uint32_t, keyframe_block_slots> sources{};
        std::vector<DeadFace> dead;
        for (uint32_t b = 0; b < key.blocks(); ++b) {
            const uint32_t first = b * keyframe_block_slots, count = std::min(keyframe_block_slots, key.slots - first);
            for (uint32_t s = 0; s < count; ++s) sources[s] = last_slots_[faces[first + s]];
            dead.clear();
            for (uint64_t left = told_[b]; left != 0; left &= left - 1) {
                const auto slot = first + static_cast<uint32_t>(std::countr_zero(left));
                for (uint32_t d = told_first_[slot]; d != none; d = told_next_[d])
                    dead.push_back(note_dead(key.slots + d, witnesses_[d]));
            }
            write_keyframe_block(std::span(sources).first(count), dead, made_.block_bytes);
            made_.block_ends.push_back(made_.block_bytes.size());
        }
    }

    // The collapse from a level to the next, and what of the other half is held there, in slots.
    void play(uint32_t level, uint32_t wedges, uint32_t faces) {
        const Ecol ecol = mesh_.ecols[level];
        if (level == forgotten_at_ && level > 0) forget_dead(wedges, faces);
        next_held_ = level >= making_from_ ? made_.keyframes[drawn_].blocks_held(level) * keyframe_block_slots : 0;
        last_held_ =
            level < forgotten_at_ ? made_.keyframes[drawn_ - 1].blocks_held(level + 1) * keyframe_block_slots : 0;
        const uint32_t split = levels_ - 2 - level;
        const uint64_t begin = split == 0 ? 0 : mesh_.arc_ends[split - 1];
        const auto arc = mesh_.arcs.subspan(begin, mesh_.arc_ends[split] - begin);
        if (!order_.drops_dead) fetch_dead(wedges);
        for (uint32_t w = wedges - 1; w + 1 > wedges - ecol.wedges; --w) {
            const uint32_t parent = mesh_.parents[mesh_.wedges - 1 - w];
            made_.first_corner.push_back(made_.corners.size());
            const auto rewrite = [&](uint32_t corner) {
                uint32_t& now = now_[corner];
                if (ecol.wedges > 1 && now != w) return;
                now = parent;
                note(corner);
            };
            for (const uint32_t corner : arc) rewrite(corner);
            if (order_.drops_dead) continue;
            for (uint32_t f = faces - ecol.faces; f < faces; ++f) rewrite(f * 3);
            rewrite_dead(w, parent);
        }
        if (order_.drops_dead) return;
        for (uint32_t f = faces - ecol.faces; f < faces; ++f) {
            for (uint32_t c = f * 3; c < f * 3 + 3; ++c) hold_dead(c, now_[c]);
        }
    }

    void note(uint32_t half, uint32_t slot, uint32_t k) {
        made_.corners.push_back(half * static_cast<uint32_t>(mesh_.indices.size()) + slot * 3 + k);
    }

    // A corner of a face that was alive so far, 3 * face + k.
    void note(uint32_t corner) {
        const uint32_t face = corner / 3, k = corner % 3, half = drawn_ & 1;
        note(half, slots_[face], k);
        if (next_held_ > 0 && face < next_slots_.size() && next_slots_[face] < next_held_)
            note(1 - half, next_slots_[face], k);
        if (last_held_ > 0 && home(face) < last_held_) note(1 - half, last_slots_[face], k);
    }

    // Leaves out of the lists what no order holds any more: most of what is dead.
    void forget_dead(uint32_t wedges, uint32_t faces) {
        std::fill_n(dead_first_.begin(), wedges, none);
        for (uint32_t c = faces * 3; c < slots_.size() * 3; ++c) hold_dead(c, now_[c]);
    }

    void hold_dead(uint32_t corner, uint32_t wedge) {
        dead_next_[corner] = dead_first_[wedge];
        dead_first_[wedge] = corner;
    }

    // Hints that the lists of wedges that go soon are read: the first of one, and the second of one that goes sooner.
    void fetch_dead(uint32_t wedges) const {
        constexpr uint32_t far = 16, near = 8;
        if (wedges <= far) return;
        if (const uint32_t first = dead_first_[wedges - far]; first != none) {
            __builtin_prefetch(&dead_next_[first]);
            __builtin_prefetch(&slots_[0] + first / 3);
        }
        if (const uint32_t first = dead_first_[wedges - near]; first != none) {
            const uint32_t second = dead_next_[first];
            if (second != none) __builtin_prefetch(&dead_next_[second]);
        }
    }

    // Corners of dead faces are numbered 3 * face + k.
    void rewrite_dead(uint32_t wedge, uint32_t parent) {
        const uint32_t half = drawn_ & 1;
        for (uint32_t corner = dead_first_[wedge], next = none; corner != none; corner = next) {
            next = dead_next_[corner];
            const uint32_t face = corner / 3, k = corner % 3;
            if (face < slots_.size()) note(half, slots_[face], k);
            if (last_held_ > 0 && home(face) < last_held_) note(1 - half, last_slots_[face], k);
            now_[corner] = parent;
            hold_dead(corner, parent);
        }
    }

    const PlayedMesh& mesh_;
    const PlannedOrder& order_;
    const uint32_t levels_;
    uint32_t drawn_ = 0;                                     // the order, 0 for full detail's
    std::vector<uint32_t> slots_, last_slots_, next_slots_;  // per face: its slot in the order drawn, and beside it
    uint32_t making_from_ = 0, forgotten_at_ = 0;            // levels where the next is, and the last is no more, held
    uint32_t next_held_ = 0, last_held_ = 0;                 // slots that are, at the level that is played
    std::unique_ptr<uint32_t[]> now_;                        // per corner of a face: its wedge at the level
    std::vector<uint32_t> dead_first_;                       // per wedge: a corner of a dead face that holds it
    std::unique_ptr<uint32_t[]> dead_next_;                  // per corner of a dead face: another
    std::vector<uint32_t> witnesses_;               // per face that died before the keyframe: one that is alive
    std::vector<uint64_t> told_;                    // per block: its slots that tell of dead faces
    std::vector<uint32_t> told_first_, told_next_;  // of those that do: a dead face, and per dead face the next
    OrderArrays made_;
};

// The same for an order that is changed by tswaps: the collapses are replayed, and the faces with them.
class SwapExpansion {
public:
    SwapExpansion(const PlayedMesh& mesh, const PlannedOrder& order)
        : mesh_(mesh),
          order_(order),
          replay_({mesh.indices.begin(), mesh.indices.end()}, mesh.wedge_vertex),
          face_at_(order.orders[0].faces) {
        slot_of_.resize(face_at_.size());
        for (uint32_t s = 0; s < face_at_.size(); ++s) slot_of_[face_at_[s]] = s;
    }

    // Nothing where a cycle has a slot that is not drawn.
    std::optional<OrderArrays> run() {
        for (const uint32_t f : face_at_) {
            for (uint32_t k = 0; k < 3; ++k) made_.indices.push_back(mesh_.indices[size_t{f} * 3 + k]);
        }
        made_.first_corner.push_back(0);
        size_t step = 0;
        uint32_t removed = 0;
        for (uint32_t i = 0; i < mesh_.ecols.size(); ++i) {
            for (uint32_t r = removed; r < removed + mesh_.ecols[i].wedges; ++r) note_corners(r);
            for (const uint32_t end = removed + mesh_.ecols[i].wedges; removed < end; ++removed)
                replay_.rewrite(mesh_.wedges - 1 - removed, mesh_.parents[removed], [](uint32_t) {});
            if (step < order_.tswaps.size() && order_.tswaps[step].level == i + 1 && !swap(step++)) return std::nullopt;
        }
        made_.tswaps = order_.tswaps;
        made_.cycle_lengths = order_.cycle_lengths;
        made_.cycle_slots = order_.cycle_slots;
        return std::move(made_);
    }

private:
    void note_corners(uint32_t r) {
        const auto begin = static_cast<ptrdiff_t>(made_.corners.size());
        replay_.for_corners(mesh_.wedges - 1 - r,
                            [&](uint32_t c) { made_.corners.push_back(slot_of_[c / 3] * 3 + c % 3); });
        std::sort(made_.corners.begin() + begin, made_.corners.end());
        made_.first_corner.push_back(made_.corners.size());
    }

    bool swap(size_t step) {
        const TswapStep& s = order_.tswaps[step];
        const size_t end =
            step + 1 < order_.tswaps.size() ? order_.tswaps[step + 1].first_cycle : order_.cycle_lengths.size();
        size_t at = s.first_slot;
        for (size_t c = s.first_cycle; c < end; ++c) {
            const auto slots = std::span(order_.cycle_slots).subspan(at, order_.cycle_lengths[c]);
            for (const uint32_t slot : slots) {
                if (slot >= face_at_.size()) return false;
            }
            const uint32_t first = face_at_[slots.front()];
            for (size_t i = 0; i + 1 < slots.size(); ++i) face_at_[slots[i]] = face_at_[slots[i + 1]];
            face_at_[slots.back()] = first;
            for (const uint32_t slot : slots) slot_of_[face_at_[slot]] = slot;
            at += slots.size();
        }
        if (s.slots_after > face_at_.size()) return false;
        for (size_t slot = s.slots_after; slot < face_at_.size(); ++slot) replay_.leave_range(face_at_[slot]);
        face_at_.resize(s.slots_after);
        return true;
    }

    const PlayedMesh& mesh_;
    const PlannedOrder& order_;
    Replay replay_;
    std::vector<uint32_t> face_at_, slot_of_;
    OrderArrays made_;
};

}  // namespace

FaceOrder OrderArrays::order(std::string name, bool drops_dead) const {
    FaceOrder order;
    order.name = std::move(name);
    order.drops_dead = drops_dead;
    order.indices = indices;
    order.first_corner = first_corner;
    order.corners = corners;
    order.tswaps = tswaps;
    order.cycle_lengths = cycle_lengths;
    order.cycle_slots = cycle_slots;
    order.keyframes = keyframes;
    order.block_ends = block_ends;
    order.block_bytes = block_bytes;
    return order;
}

Result<OrderArrays> arrays_of(const PlayedMesh& mesh, const PlannedOrder& order) {
    LODE_CHECK(!order.orders.empty());
    if (order.tswaps.empty()) return Expansion(mesh, order).run();
    auto arrays = SwapExpansion(mesh, order).run();
    if (!arrays)
        return fail(Fault::format, "lod/" + order.name + "/cycles: a slot is out of range; bake the asset again");
    return std::move(*arrays);
}

}  // namespace lodestone
