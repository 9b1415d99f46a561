#include "lod/asset/order_arrays.h"

#include <algorithm>
#include <array>
#include <numeric>
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

class Expansion {
public:
    Expansion(const PlayedMesh& mesh, const PlannedOrder& order)
        : mesh_(mesh), order_(order), levels_(static_cast<uint32_t>(mesh.ecols.size()) + 1) {
        gone_at_.assign(mesh.wedges, levels_);
        wedges_at_.reserve(levels_);
        triangles_at_.reserve(levels_);
        wedges_at_.push_back(mesh.wedges);
        triangles_at_.push_back(static_cast<uint32_t>(mesh.indices.size() / 3));
        for (uint32_t i = 0; i < mesh.ecols.size(); ++i) {
            wedges_at_.push_back(wedges_at_.back() - mesh.ecols[i].wedges);
            triangles_at_.push_back(triangles_at_.back() - mesh.ecols[i].faces);
            std::fill(gone_at_.begin() + wedges_at_[i + 1], gone_at_.begin() + wedges_at_[i], i + 1);
        }
    }

    Result<OrderArrays> run() {
        plan_reaches();
        now_.assign(mesh_.indices.begin(), mesh_.indices.end());
        made_.indices.resize(now_.size());
        uint32_t* index = made_.indices.data();
        for (const uint32_t face : order_.orders[0].faces) index = std::copy_n(&now_[size_t{face} * 3], 3, index);
        counts_.assign(mesh_.parents.size() + 1, 0);
        slots_ = slots_by_face(0);
        const auto last = static_cast<uint32_t>(order_.orders.size()) - 1;
        for (uint32_t k = 1; k <= last; ++k) enter_keyframe(k);
        note_corners(last);
        if (auto done = sort_corners(); !done) return tl::unexpected(done.error());
        if (made_.block_bytes.size() > Limits{}.lod_entries)
            return fail(Fault::format,
                        "order " + order_.name + " " +
                            over_limit("bytes of keyframes", made_.block_bytes.size(), Limits{}.lod_entries));
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

    std::vector<uint32_t> slots_by_face(uint32_t k) const {
        const auto& faces = order_.orders[k].faces;
        std::vector<uint32_t> slots(faces.size());
        for (uint32_t s = 0; s < faces.size(); ++s) slots[faces[s]] = s;
        return slots;
    }

    // What a wedge is at a level that has this many.
    uint32_t wedge_at(uint32_t wedge, uint32_t wedges) const {
        while (wedge >= wedges) wedge = mesh_.parents[mesh_.wedges - 1 - wedge];
        return wedge;
    }

    // A keyframe's blocks, and what was noted of the order before it.
    void enter_keyframe(uint32_t k) {
        const auto& before = order_.orders[k - 1].faces;
        const Keyframe& key = made_.keyframes[k - 1];
        const std::vector<uint32_t> slots_before = std::exchange(slots_, slots_by_face(k));
        // The witness of a dead face that is alive now; found once, and in rising order of faces.
        witnesses_.resize(before.size() - key.slots);
        for (uint32_t f = key.slots; f < before.size(); ++f) {
            const uint32_t older = mesh_.witnesses[f];
            witnesses_[f - key.slots] = older == none || older < key.slots ? older : witnesses_[older - key.slots];
        }
        note_corners(k - 1);
        collect_dead(k);
        write_blocks(k, slots_before);
    }

    // The slot in the keyframe that is entered which tells of a face of the order before.
    uint32_t home(uint32_t face) const {
        const auto slots = static_cast<uint32_t>(slots_.size());
        const uint32_t alive = face < slots ? face : witnesses_[face - slots];
        return alive == none ? 0 : slots_[alive];
    }

    // The dead of the order before by the slots that tell of them, and by their own.
    void collect_dead(uint32_t k) {
        const auto& before = order_.orders[k - 1].faces;
        const Keyframe& key = made_.keyframes[k - 1];
        dead_begin_.assign(size_t{key.slots} + 2, 0);
        for (uint32_t f = key.slots; f < before.size(); ++f) ++dead_begin_[home(f) + 2];
        std::partial_sum(dead_begin_.begin(), dead_begin_.end(), dead_begin_.begin());
        dead_.resize(before.size() - key.slots);
        for (uint32_t slot = 0; slot < before.size(); ++slot) {
            const uint32_t face = before[slot];
            if (face < key.slots) continue;
            dead_[dead_begin_[home(face) + 1]++] = note_dead(face, slot, witnesses_[face - key.slots], key.level);
        }
    }

    DeadFace note_dead(uint32_t face, uint32_t slot, uint32_t alive, uint32_t level) const {
        const uint32_t wedges = wedges_at_[level];
        DeadFace noted;
        noted.slot = slot;
        std::array<uint32_t, 3> beside{};
        for (size_t k = 0; k < 3; ++k) {
            noted.wedges[k] = wedge_at(now_[size_t{face} * 3 + k], wedges);
            if (alive != none) beside[k] = wedge_at(now_[size_t{alive} * 3 + k], wedges);
        }
        noted.literal = alive == none;
        for (size_t k = 0; k < 3 && !noted.literal; ++k) {
            uint8_t corner = 0;
            while (corner < 3 && beside[corner] != noted.wedges[k]) ++corner;
            noted.literal = corner == 3;  // at a seam
            noted.corners[k] = corner;
        }
        if (noted.literal) {
            noted.corners = {};
        } else {
            noted.wedges = {};
        }
        noted.neighbour = static_cast<uint8_t>((alive == none ? 0 : slots_[alive]) % keyframe_block_slots);
        return noted;
    }

    void write_blocks(uint32_t k, const std::vector<uint32_t>& slots_before) {
        Keyframe& key = made_.keyframes[k - 1];
        key.first_block = static_cast<uint32_t>(made_.block_ends.size());
        const auto& faces = order_.orders[k].faces;
        std::array<uint32_t, keyframe_block_slots> sources{};
        for (uint32_t b = 0; b < key.blocks(); ++b) {
            const uint32_t first = b * keyframe_block_slots, count = std::min(keyframe_block_slots, key.slots - first);
            for (uint32_t s = 0; s < count; ++s) sources[s] = slots_before[faces[first + s]];
            const uint32_t dead = dead_begin_[first], end = dead_begin_[first + count];
            write_keyframe_block(std::span(sources).first(count), std::span(dead_).subspan(dead, end - dead),
                                 made_.block_bytes);
            made_.block_ends.push_back(static_cast<uint32_t>(made_.block_bytes.size()));
        }
    }

    // While an order is held: from the level where its first blocks are made to the one where its last are forgotten.
    // Wedges go by falling number, so levels are told by them.
    struct Stay {
        const Keyframe* own = nullptr;   // null for full detail
        const Keyframe* next = nullptr;  // null for the last
        uint32_t half = 0;
        uint32_t end_wedges = 0;     // that are not gone where the stay ends
        uint32_t window_wedges = 0;  // nor where that of the next order begins
        // All blocks of the order are held, and it is drawn, where wedges go that are in between.
        uint32_t drawn_wedges = 0, change_wedges = 0;
    };
    Stay stay_of(uint32_t k) const {
        Stay stay;
        stay.own = k == 0 ? nullptr : &made_.keyframes[k - 1];
        stay.next = k < made_.keyframes.size() ? &made_.keyframes[k] : nullptr;
        stay.half = k & 1;
        stay.end_wedges = wedges_at_.back();
        if (stay.next != nullptr) {
            stay.end_wedges = wedges_at_[std::min(levels_ - 1, stay.next->level + stay.next->reach())];
            stay.window_wedges = wedges_at_[stay.next->level - stay.next->reach()];
            stay.change_wedges = wedges_at_[stay.next->level];
        }
        // What drops the dead looks at every one.
        stay.drawn_wedges = order_.drops_dead ? 0 : wedges_at_[level_of(k)];
        return stay;
    }

    // Corners of order k; leaves its faces as they are where the stay of the next order begins.
    void note_corners(uint32_t k) {
        const Stay stay = stay_of(k);
        const auto& faces = order_.orders[k].faces;
        for (uint32_t s = 0; s < faces.size(); ++s) {
            uint32_t* corners = &now_[size_t{faces[s]} * 3];
            if (std::max({corners[0], corners[1], corners[2]}) < stay.end_wedges) continue;
            for (uint32_t c = 0; c < 3; ++c) {
                if (corners[c] >= stay.end_wedges) corners[c] = note_corner(stay, faces[s], s * 3 + c, corners[c]);
            }
        }
    }

    // Returns the wedge of the corner where the stay of the next order begins.
    uint32_t note_corner(const Stay& stay, uint32_t face, uint32_t position, uint32_t wedge) {
        uint32_t later = wedge;
        for (uint32_t w = wedge; w >= stay.end_wedges;) {
            const uint32_t removed = mesh_.wedges - 1 - w;
            if ((w < stay.drawn_wedges && w >= stay.change_wedges) || held(stay, face, position / 3, w)) {
                ++counts_[removed];
                noted_[stay.half].push_back({removed, IndexSlot::of(stay.half, position)});
            }
            w = mesh_.parents[removed];
            if (later >= stay.window_wedges) later = w;
        }
        return later;
    }

    // Whether a slot of an order holds its face where a wedge goes.
    bool held(const Stay& stay, uint32_t face, uint32_t slot, uint32_t wedge) const {
        const uint32_t ecol = gone_at_[wedge] - 1;
        if (order_.drops_dead) return face < triangles_at_[ecol + 1];
        if (wedge >= stay.drawn_wedges) return slot / keyframe_block_slots < stay.own->blocks_held(ecol);
        return home(face) / keyframe_block_slots < stay.next->blocks_held(ecol + 1);
    }

    // By removed wedge, half and position: positions come in rising order as they are noted.
    Result<void> sort_corners() {
        const size_t all = noted_[0].size() + noted_[1].size();
        if (all > Limits{}.lod_entries)
            return fail(Fault::format,
                        "order " + order_.name + " " + over_limit("corners rewritten", all, Limits{}.lod_entries));
        std::exclusive_scan(counts_.begin(), counts_.end(), counts_.begin(), 0u);
        made_.first_corner = counts_;
        made_.corners.resize(all);
        for (const auto& half : noted_) {
            for (const Noted& noted : half) made_.corners[counts_[noted.removed]++] = noted.corner;
        }
        return {};
    }

    const PlayedMesh& mesh_;
    const PlannedOrder& order_;
    const uint32_t levels_;
    std::vector<uint32_t> wedges_at_, triangles_at_;  // per level
    std::vector<uint32_t> gone_at_;                   // per wedge: the level from which on it is gone
    std::vector<uint32_t> now_;                       // per corner of a face: its wedge at some level before
    std::vector<uint32_t> witnesses_;                 // per face that died: one that is alive
    std::vector<DeadFace> dead_;                      // of a keyframe, by the slots that tell of them
    std::vector<uint32_t> dead_begin_;                // per slot: the first of them
    std::vector<uint32_t> slots_;                     // per face: its slot in the keyframe that is entered
    std::vector<uint32_t> counts_;                    // per removed wedge: its corners
    struct Noted {
        uint32_t removed;  // the wedge
        IndexSlot corner;
    };
    std::array<std::vector<Noted>, 2> noted_;  // by half
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
        replay_.for_corners(mesh_.wedges - 1 - r, [&](uint32_t c) {
            made_.corners.push_back(IndexSlot::of(0, slot_of_[c / 3] * 3 + c % 3));
        });
        std::sort(made_.corners.begin() + begin, made_.corners.end(),
                  [](IndexSlot a, IndexSlot b) { return a.position() < b.position(); });
        made_.first_corner.push_back(static_cast<uint32_t>(made_.corners.size()));
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
