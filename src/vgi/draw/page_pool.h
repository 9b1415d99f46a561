// Slots for pages, least recently used ones given away first.
//
// A page stays while a page that is coded against it is there, while it is pinned, while the frame being planned uses
// it, and while a frame that drew it may still be on the GPU.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"

namespace lodestone::vgi {

class PagePool {
public:
    static constexpr uint32_t nothing = ~0u;

    // pages: numbered 0 .. pages - 1, of which at most `slots` are there at once.
    PagePool(uint32_t pages, uint32_t slots);

    uint32_t slots() const { return static_cast<uint32_t>(page_in_.size()); }
    uint32_t resident() const { return resident_; }
    // Slots that a page could be given in this frame, at most.
    uint32_t available() const { return slots() - resident_ + idle_; }
    uint32_t slot_of(uint32_t page) const { return entries_[page].slot; }
    bool holds(uint32_t page) const { return entries_[page].slot != nothing; }

    // A new frame is planned; frames before `completed` have left the GPU. Both never fall.
    void begin_frame(uint64_t frame, uint64_t completed);
    // The page, which is there, is used by this frame. Call it for pages before their parents.
    void touch(uint32_t page);

    struct Placed {
        uint32_t slot = nothing;
        uint32_t evicted = nothing;  // the page that was there
    };
    // Finds a slot for a page that is not there; its parent (nothing for none) must be. Nothing where every slot is
    // in use. The page counts as used by this frame.
    std::optional<Placed> place(uint32_t page, uint32_t parent, bool pinned);

    Result<void> validate() const;

private:
    struct Entry {
        uint32_t slot = nothing, parent = nothing, children = 0;
        uint32_t before = nothing, after = nothing;  // in order of use
        uint64_t used = 0;                           // frame
        bool pinned = false;
    };
    void unlink(uint32_t page);
    void link_last(uint32_t page);
    bool idle(const Entry& e) const { return !e.pinned && e.used < frame_; }

    std::vector<Entry> entries_;
    std::vector<uint32_t> page_in_;              // per slot
    std::vector<uint32_t> free_;                 // slots, the lowest last
    uint32_t first_ = nothing, last_ = nothing;  // the page unused longest; the one used last; without pinned ones
    uint32_t resident_ = 0, pinned_ = 0, idle_ = 0;
    uint64_t frame_ = 1, completed_ = 0;
};

}  // namespace lodestone::vgi
