// Many small lists of bytes in two blocks of memory: a list of its own for each would take memory that cannot be
// spilled (base/spill.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace lodestone {

// Lists by number, from 0.
class ByteLists {
public:
    // The bytes of a list; valid until another is added.
    using List = std::span<const std::byte>;

    // How many lists there are.
    size_t size() const { return ends_.size(); }
    // Whether there is none.
    bool empty() const { return ends_.empty(); }
    // i < size().
    List operator[](size_t i) const;
    // Appends a list.
    void add(List list);
    // Appends all lists of another.
    void add(const ByteLists& all);
    // Makes room for so many lists with so many bytes together.
    void reserve(size_t lists, uint64_t bytes);
    // Gives back what room is left.
    void shrink_to_fit();

    // One list after the other.
    List bytes() const { return bytes_; }
    // Where each ends in bytes().
    std::span<const uint64_t> ends() const { return ends_; }
    // Whether both have the same lists.
    bool operator==(const ByteLists&) const = default;

private:
    std::vector<std::byte> bytes_;
    std::vector<uint64_t> ends_;
};

}  // namespace lodestone
