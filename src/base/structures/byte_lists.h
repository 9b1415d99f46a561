// Many small lists of bytes in two blocks of memory: a list of its own for each would take memory that cannot be
// spilled (base/spill.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <vector>

#include "base/check.h"

namespace lodestone {

class ByteLists {
public:
    using List = std::span<const std::byte>;

    size_t size() const { return ends_.size(); }
    bool empty() const { return ends_.empty(); }
    List operator[](size_t i) const {
        LODE_CHECK(i < ends_.size(), i);
        const uint64_t begin = i == 0 ? 0 : ends_[i - 1];
        return std::span(bytes_).subspan(begin, ends_[i] - begin);
    }
    void add(List list) {
        bytes_.insert(bytes_.end(), list.begin(), list.end());
        ends_.push_back(bytes_.size());
    }
    void add(const ByteLists& all) {
        const uint64_t before = bytes_.size();
        bytes_.insert(bytes_.end(), all.bytes_.begin(), all.bytes_.end());
        for (const uint64_t end : all.ends_) ends_.push_back(before + end);
    }
    void reserve(size_t lists, uint64_t bytes) {
        ends_.reserve(lists);
        bytes_.reserve(bytes);
    }
    void shrink_to_fit() {
        ends_.shrink_to_fit();
        bytes_.shrink_to_fit();
    }

    // One list after the other, and where each ends.
    List bytes() const { return bytes_; }
    std::span<const uint64_t> ends() const { return ends_; }

    class Iterator {
    public:
        using value_type = List;
        using difference_type = std::ptrdiff_t;
        Iterator() = default;
        Iterator(const ByteLists& lists, size_t at) : lists_(&lists), at_(at) {}
        List operator*() const { return (*lists_)[at_]; }
        Iterator& operator++() {
            ++at_;
            return *this;
        }
        Iterator operator++(int) {
            const Iterator before = *this;
            ++at_;
            return before;
        }
        bool operator==(const Iterator& other) const { return at_ == other.at_; }

    private:
        const ByteLists* lists_ = nullptr;
        size_t at_ = 0;
    };
    Iterator begin() const { return {*this, 0}; }
    Iterator end() const { return {*this, size()}; }

    bool operator==(const ByteLists&) const = default;

private:
    std::vector<std::byte> bytes_;
    std::vector<uint64_t> ends_;
};

}  // namespace lodestone
