#include "vgi/draw/page_pool.h"

#include <string>

#include "base/check.h"

namespace lodestone::vgi {

PagePool::PagePool(uint32_t pages, uint32_t slots) : entries_(pages), page_in_(slots, nothing) {
    for (uint32_t slot = slots; slot-- > 0;) free_.push_back(slot);
}

void PagePool::begin_frame(uint64_t frame, uint64_t completed) {
    LODE_CHECK(frame + 1 >= frame_ && completed >= completed_, frame, completed);
    // Frames are counted from 1 here, so that 0 is before all of them.
    if (frame + 1 > frame_) idle_ = resident_ - pinned_;  // nothing is used by the new frame yet
    frame_ = frame + 1;
    completed_ = completed;
}

void PagePool::touch(uint32_t page) {
    Entry& e = entries_[page];
    LODE_CHECK(e.slot != nothing, page);
    if (e.pinned) return;
    if (e.used < frame_) --idle_;
    e.used = frame_;
    unlink(page);
    link_last(page);
}

std::optional<PagePool::Placed> PagePool::place(uint32_t page, uint32_t parent, bool pinned) {
    LODE_CHECK(!holds(page) && (parent == nothing || holds(parent)), page, parent);
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
        Entry& gone = entries_[victim];
        placed = {gone.slot, victim};
        unlink(victim);
        if (gone.parent != nothing) --entries_[gone.parent].children;
        gone = {};
        --idle_;
        --resident_;
    }
    Entry& e = entries_[page];
    e.slot = placed.slot;
    e.parent = parent;
    e.used = frame_;
    e.pinned = pinned;
    if (parent != nothing) ++entries_[parent].children;
    page_in_[placed.slot] = page;
    ++resident_;
    pinned_ += pinned;
    if (!pinned) link_last(page);
    return placed;
}

void PagePool::unlink(uint32_t page) {
    Entry& e = entries_[page];
    (e.before == nothing ? first_ : entries_[e.before].after) = e.after;
    (e.after == nothing ? last_ : entries_[e.after].before) = e.before;
    e.before = e.after = nothing;
}

void PagePool::link_last(uint32_t page) {
    Entry& e = entries_[page];
    e.before = last_;
    (last_ == nothing ? first_ : entries_[last_].after) = page;
    last_ = page;
}

Result<void> PagePool::validate() const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "page pool: " + what); };
    std::vector<uint32_t> children(entries_.size(), 0);
    uint32_t resident = 0, pinned = 0;
    for (uint32_t page = 0; page < entries_.size(); ++page) {
        const Entry& e = entries_[page];
        if (e.slot == nothing) continue;
        ++resident;
        pinned += e.pinned;
        if (e.slot >= slots() || page_in_[e.slot] != page) return wrong("two pages have one slot");
        if (e.parent == nothing) continue;
        if (!holds(e.parent)) return wrong("page " + std::to_string(page) + " is there without its parent");
        ++children[e.parent];
    }
    if (resident != resident_ || resident + free_.size() != slots()) return wrong("slots are lost");
    uint64_t used = 0;
    uint32_t linked = 0, idle_pages = 0;
    for (uint32_t page = first_; page != nothing; page = entries_[page].after) {
        if (entries_[page].used < used) return wrong("pages are not in order of use");
        used = entries_[page].used;
        idle_pages += used < frame_;
        if (++linked > resident) return wrong("the order of use has no end");
    }
    if (pinned != pinned_ || idle_pages != idle_) return wrong("pages are miscounted");
    if (linked + pinned != resident) return wrong("a page is missing from the order of use");
    for (uint32_t page = 0; page < entries_.size(); ++page) {
        if (entries_[page].children != children[page]) return wrong("children are miscounted");
    }
    return {};
}

}  // namespace lodestone::vgi
