// What cuts found of the pages of one atlas' layer: those they used, and those they missed. What it costs goes with
// what was found, not with how many pages there are.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace lodestone::vgi {

class PageDemand {
public:
    // pages: of all charts.
    explicit PageDemand(uint32_t pages = 0) : touched_at_(pages, 0), asked_at_(pages, 0), wish_(pages, 0.0f) {}

    uint32_t pages() const { return static_cast<uint32_t>(wish_.size()); }
    // Forgets what was found; keeps its room.
    void clear() {
        ++now_;
        touched_.clear();
        asked_.clear();
    }

    // A sample of the page is in the cut.
    void touch(uint32_t page) {
        if (mark(page)) touched_.push_back(page);
    }
    // In two halves, for threads: mark() by any number of threads of which no two have a page in common, true where the
    // page was not marked; add_marked() by one, for each of those.
    bool mark(uint32_t page) {
        if (touched_at_[page] == now_) return false;
        touched_at_[page] = now_;
        return true;
    }
    void add_marked(std::span<const uint32_t> pages) { touched_.insert(touched_.end(), pages.begin(), pages.end()); }

    // Of a missing page: how many times the pixel error leaving it out may cost, less where no camera sees it.
    void ask(uint32_t page, float wish) {
        if (asked_at_[page] != now_) {
            asked_at_[page] = now_;
            asked_.push_back(page);
            wish_[page] = wish;
        } else {
            wish_[page] = std::max(wish_[page], wish);
        }
    }
    // What another one of the same pages found, too.
    void add(const PageDemand& other) {
        for (const uint32_t page : other.touched_) touch(page);
        for (const uint32_t page : other.asked_) ask(page, other.wish_[page]);
    }
    bool touched(uint32_t page) const { return touched_at_[page] == now_; }
    float wish(uint32_t page) const { return asked_at_[page] == now_ ? wish_[page] : 0; }  // 0: not asked for

    // Highest numbers first, so children before their parents.
    std::vector<uint32_t> all_touched() const { return falling(touched_); }
    std::vector<uint32_t> all_asked() const { return falling(asked_); }

private:
    static std::vector<uint32_t> falling(std::vector<uint32_t> pages) {
        std::ranges::sort(pages, std::greater<>());
        return pages;
    }
    std::vector<uint32_t> touched_at_, asked_at_;  // per page: `now_` if it was, since the last clear()
    std::vector<float> wish_;
    std::vector<uint32_t> touched_, asked_;
    uint32_t now_ = 1;
};

}  // namespace lodestone::vgi
