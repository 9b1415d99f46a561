// The faces of the drawn range by slot, permuted in place: what an order that uses tswaps sees and changes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/none.h"
#include "lod/asset/replay.h"

namespace lodestone {

// Which face is in which slot. Swaps are noted, so that all since the last take_cycles() become cycles.
class DrawnFaces {
public:
    // face_at: face of each slot; slot_of: its inverse; replay: of the same faces. All are kept by reference.
    DrawnFaces(std::vector<uint32_t>& face_at, std::vector<uint32_t>& slot_of, Replay& replay)
        : replay_(replay),
          face_at_(face_at),
          slot_of_(slot_of),
          noted_(face_at.size(), none),
          slots_(static_cast<uint32_t>(face_at.size())) {}

    uint32_t slots() const { return slots_; }                         // drawn
    uint32_t alive_count() const { return alive_; }                   // of them, faces alive
    void died(uint32_t faces) { alive_ -= faces; }                    // tells of a collapse
    uint32_t face_at(uint32_t slot) const { return face_at_[slot]; }  // slot: below slots()
    uint32_t slot_of(uint32_t face) const { return slot_of_[face]; }  // none once it is behind the drawn range
    bool alive(uint32_t slot) const { return replay_.alive(face_at_[slot]); }
    // The three wedges of the face in a slot, two equal vertices where it is dead.
    const uint32_t* wedges(uint32_t slot) const { return &replay_.indices()[size_t{face_at_[slot]} * 3]; }
    // Slots of the faces that hold a wedge, alive or dead.
    template <class Visit>
    void for_slots(uint32_t wedge, Visit&& visit) const {
        replay_.for_corners(wedge, [&](uint32_t corner) { visit(slot_of_[corner / 3]); });
    }

    // Exchanges the faces of two slots.
    void swap(uint32_t a, uint32_t b) {
        note(a);
        note(b);
        std::swap(face_at_[a], face_at_[b]);
        slot_of_[face_at_[a]] = a;
        slot_of_[face_at_[b]] = b;
    }
    // The last slot, in which a dead face is, leaves the drawn range.
    void drop_last() {
        const uint32_t face = face_at_[--slots_];
        LODE_CHECK(!replay_.alive(face), face);
        replay_.leave_range(face);
        slot_of_[face] = none;
    }

    // Slots swapped since the last take_cycles().
    size_t written() const { return touched_.size(); }

    // The permutation since the last call, as cycles f of at least two slots: f[i] receives what f[i + 1] held.
    // cycle(span of slots) for each, by rising first slot.
    template <class Cycle>
    void take_cycles(Cycle&& cycle) {
        std::sort(touched_.begin(), touched_.end());
        for (const uint32_t start : touched_) {
            cycle_.clear();
            for (uint32_t s = start; noted_[face_at_[s]] != s && noted_[face_at_[s]] != none;) {
                cycle_.push_back(s);
                s = std::exchange(noted_[face_at_[s]], none);
            }
            if (!cycle_.empty()) cycle(cycle_);
        }
        for (const uint32_t slot : touched_) noted_[face_at_[slot]] = none;
        touched_.clear();
    }

private:
    void note(uint32_t slot) {
        uint32_t& noted = noted_[face_at_[slot]];
        if (noted != none) return;
        noted = slot;
        touched_.push_back(slot);
    }

    Replay& replay_;
    std::vector<uint32_t>&face_at_, &slot_of_;
    std::vector<uint32_t> noted_;  // per face that was swapped: its slot at the last take_cycles()
    std::vector<uint32_t> touched_, cycle_;
    uint32_t slots_, alive_ = slots_;
};

}  // namespace lodestone
