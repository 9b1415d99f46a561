// Slots of a pool for pages, least recently used ones given away first. What page is where, the page cache knows
// (page_cache.h); here is only which slot may be given to another page.
//
// A slot keeps its page while a page that is coded against it is there, while it is pinned, while the frame being
// planned uses it, and while a frame that drew it may still be on the GPU.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"

namespace lodestone::vgi {

class SlotPool {
public:
    static constexpr uint32_t nothing = ~0u;

    explicit SlotPool(uint32_t slots);
    // More slots, after those there are.
    void grow(uint32_t slots);

    bool full() const { return free_.empty(); }  // a page that is placed needs the slot of another
    uint32_t slots() const { return static_cast<uint32_t>(entries_.size()); }
    uint32_t resident() const { return resident_; }
    // Slots that a page could be given in this frame, at most.
    uint32_t available() const { return slots() - resident_ + idle_; }

    // A new frame is planned; frames before `completed` have left the GPU. Both never fall.
    void begin_frame(uint64_t frame, uint64_t completed);
    // The page in this slot is used by this frame. Call it for pages before their parents.
    void touch(uint32_t slot);

    struct Placed {
        uint32_t slot = nothing;
        uint32_t evicted = nothing;  // the page that was there
    };
    // Finds a slot for a page that has none; `parent`: the slot of its parent, nothing for none. Nothing where every
    // slot is in use. The page counts as used by this frame.
    std::optional<Placed> place(uint32_t page, uint32_t parent, bool pinned);
    uint32_t page_in(uint32_t slot) const { return entries_[slot].page; }  // nothing for none

    Result<void> validate() const;

private:
    struct Entry {
        uint32_t page = nothing, parent = nothing, children = 0;  // parent: a slot
        uint32_t before = nothing, after = nothing;               // slots, in order of use
        uint64_t used = 0;                                        // frame
        bool pinned = false;
    };
    void unlink(uint32_t slot);
    void link_last(uint32_t slot);
    bool idle(const Entry& e) const { return !e.pinned && e.used < frame_; }

    std::vector<Entry> entries_;                 // per slot
    std::vector<uint32_t> free_;                 // slots, the lowest last
    uint32_t first_ = nothing, last_ = nothing;  // the slot unused longest; the one used last; without pinned ones
    uint32_t resident_ = 0, pinned_ = 0, idle_ = 0;
    uint64_t frame_ = 1, completed_ = 0;
};

}  // namespace lodestone::vgi
