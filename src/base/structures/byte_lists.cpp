#include "base/structures/byte_lists.h"

#include "base/check.h"

namespace lodestone {

ByteLists::List ByteLists::operator[](size_t i) const {
    LODE_CHECK(i < ends_.size(), i);
    const uint64_t begin = i == 0 ? 0 : ends_[i - 1];
    return std::span(bytes_).subspan(begin, ends_[i] - begin);
}

void ByteLists::add(List list) {
    bytes_.insert(bytes_.end(), list.begin(), list.end());
    ends_.push_back(bytes_.size());
}

void ByteLists::add(const ByteLists& all) {
    const uint64_t before = bytes_.size();
    bytes_.insert(bytes_.end(), all.bytes_.begin(), all.bytes_.end());
    for (const uint64_t end : all.ends_) ends_.push_back(before + end);
}

void ByteLists::reserve(size_t lists, uint64_t bytes) {
    ends_.reserve(lists);
    bytes_.reserve(bytes);
}

void ByteLists::shrink_to_fit() {
    ends_.shrink_to_fit();
    bytes_.shrink_to_fit();
}

}  // namespace lodestone
