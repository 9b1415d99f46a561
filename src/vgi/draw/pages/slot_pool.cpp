#include "vgi/draw/pages/slot_pool.h"

#include <numeric>
#include <string>

#include "base/check.h"

namespace lodestone::vgi {

SlotPool::SlotPool(uint32_t slots) : entries_(slots) {
    for (uint32_t slot = slots; slot-- > 0;) free_.push_back(slot);
}

void SlotPool::grow(uint32_t slots) {
    const uint32_t before = this->slots();
    LODE_CHECK(slots >= before, slots, before);
    entries_.resize(slots);
    std::vector<uint32_t> more(slots - before);
    std::iota(more.rbegin(), more.rend(), before);
    free_.insert(free_.begin(), more.begin(), more.end());
}

void SlotPool::begin_frame(uint64_t frame, uint64_t completed) {
    LODE_CHECK(frame + 1 >= frame_ && completed >= completed_, frame, completed);
    // Frames are counted from 1 here, so that 0 is before all of them.
    if (frame + 1 > frame_) idle_ = resident_ - pinned_;  // nothing is used by the new frame yet
    frame_ = frame + 1;
    completed_ = completed;
}

void SlotPool::touch(uint32_t slot) {
    LODE_CHECK(slot < slots() && entries_[slot].page != nothing, slot);
    Entry& e = entries_[slot];
    if (e.pinned) return;
    if (e.used < frame_) --idle_;
    e.used = frame_;
    unlink(slot);
    link_last(slot);
}

std::optional<SlotPool::Placed> SlotPool::place(uint32_t page, uint32_t parent, bool pinned) {
    LODE_CHECK(parent == nothing || entries_[parent].page != nothing, page, parent);
    Placed placed;
    if (!free_.empty()) {
        placed.slot = free_.back();
        free_.pop_back();
    } else {
        uint32_t victim = first_;
        const auto may_go = [&](const Entry& e) { return e.children == 0 && e.used <= completed_; };
        while (victim != nothing && idle(entries_[victim]) && (victim == parent || !may_go(entries_[victim])))
            victim = entries_[victim].after;
        if (victim == nothing || !idle(entries_[victim])) return std::nullopt;
        placed = {victim, entries_[victim].page};
        unlink(victim);
        if (entries_[victim].parent != nothing) --entries_[entries_[victim].parent].children;
        --idle_;
        --resident_;
    }
    Entry& e = entries_[placed.slot];
    e = {};
    e.page = page;
    e.parent = parent;
    e.used = frame_;
    e.pinned = pinned;
    if (parent != nothing) ++entries_[parent].children;
    ++resident_;
    pinned_ += pinned;
    if (!pinned) link_last(placed.slot);
    return placed;
}

void SlotPool::unlink(uint32_t slot) {
    Entry& e = entries_[slot];
    (e.before == nothing ? first_ : entries_[e.before].after) = e.after;
    (e.after == nothing ? last_ : entries_[e.after].before) = e.before;
    e.before = e.after = nothing;
}

void SlotPool::link_last(uint32_t slot) {
    Entry& e = entries_[slot];
    e.before = last_;
    (last_ == nothing ? first_ : entries_[last_].after) = slot;
    last_ = slot;
}

Result<void> SlotPool::validate() const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "slot pool: " + what); };
    std::vector<uint32_t> children(entries_.size(), 0);
    uint32_t resident = 0, pinned = 0;
    for (uint32_t slot = 0; slot < entries_.size(); ++slot) {
        const Entry& e = entries_[slot];
        if (e.page == nothing) continue;
        ++resident;
        pinned += e.pinned;
        if (e.parent == nothing) continue;
        if (entries_[e.parent].page == nothing)
            return wrong("page " + std::to_string(e.page) + " is there without its parent");
        ++children[e.parent];
    }
    if (resident != resident_ || resident + free_.size() != slots()) return wrong("slots are lost");
    uint64_t used = 0;
    uint32_t linked = 0, idle_slots = 0;
    for (uint32_t slot = first_; slot != nothing; slot = entries_[slot].after) {
        if (entries_[slot].used < used) return wrong("slots are not in order of use");
        used = entries_[slot].used;
        idle_slots += used < frame_;
        if (++linked > resident) return wrong("the order of use has no end");
    }
    if (pinned != pinned_ || idle_slots != idle_) return wrong("slots are miscounted");
    if (linked + pinned != resident) return wrong("a slot is missing from the order of use");
    for (uint32_t slot = 0; slot < entries_.size(); ++slot) {
        if (entries_[slot].children != children[slot]) return wrong("children are miscounted");
    }
    return {};
}

}  // namespace lodestone::vgi
