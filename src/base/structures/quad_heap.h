// A priority queue with four children to a node: a pop looks at half as many levels as in a binary heap, and the four
// lie side by side in memory, which is what large queues wait for.
//
//   LaMarca, Ladner, "The influence of caches on the performance of heaps", ACM JEA 1996.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace lodestone {

// The least item first, by operator<. Items that are equal come out in some order.
template <class Item>
class QuadHeap {
public:
    bool empty() const { return items_.empty(); }
    void clear() { items_.clear(); }
    void push(Item item) {
        size_t at = items_.size();
        items_.push_back(item);
        while (at > 0 && item < items_[(at - 1) / 4]) {
            items_[at] = std::move(items_[(at - 1) / 4]);
            at = (at - 1) / 4;
        }
        items_[at] = std::move(item);
    }
    Item pop() {
        Item top = std::move(items_[0]), last = std::move(items_.back());
        items_.pop_back();
        const size_t size = items_.size();
        if (size == 0) return top;
        size_t at = 0;
        for (size_t first = 1; first < size; first = 4 * at + 1) {
            size_t least = first;
            const size_t end = first + 4 < size ? first + 4 : size;
            for (size_t child = first + 1; child < end; ++child) least = items_[child] < items_[least] ? child : least;
            if (!(items_[least] < last)) break;
            items_[at] = std::move(items_[least]);
            at = least;
        }
        items_[at] = std::move(last);
        return top;
    }

private:
    std::vector<Item> items_;
};

}  // namespace lodestone
