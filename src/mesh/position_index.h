// Which points lie at exactly the same place. -0 and 0 are one place.
#pragma once

#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace lodestone {

// Open addressing over the points' bits: a node per point would cost more than all else.
class PositionIndex {
public:
    static constexpr uint32_t nowhere = ~0u;  // no point is there

    // The points that are looked for.
    // positions: must outlive this; at most 2^32 - 1.
    explicit PositionIndex(std::span<const glm::vec3> positions)
        : positions_(positions), table_(std::bit_ceil(positions.size() * 2 + 1), nowhere) {
        first_at_.reserve(positions.size());
        for (uint32_t v = 0; v < positions.size(); ++v) {
            uint32_t& slot = table_[slot_of(positions[v])];
            if (slot == nowhere) slot = v;
            first_at_.push_back(slot);
        }
    }
    // Per point: the first at its place.
    const std::vector<uint32_t>& first_at() const { return first_at_; }
    // The first point at this place, or nowhere.
    uint32_t find(const glm::vec3& p) const { return table_[slot_of(p)]; }

private:
    struct Key {
        uint32_t x, y, z;
        bool operator==(const Key&) const = default;
    };
    static Key key_of(const glm::vec3& p) {
        // Adding 0 turns -0 into 0.
        return {std::bit_cast<uint32_t>(p.x + 0.0f), std::bit_cast<uint32_t>(p.y + 0.0f),
                std::bit_cast<uint32_t>(p.z + 0.0f)};
    }
    static size_t hash_of(const Key& k) {
        uint64_t h = k.x * 0x9e3779b97f4a7c15ull;
        h = (h ^ (h >> 29) ^ k.y) * 0xbf58476d1ce4e5b9ull;
        h = (h ^ (h >> 32) ^ k.z) * 0x94d049bb133111ebull;
        return static_cast<size_t>(h ^ (h >> 31));
    }
    // Where the place is in the table, or where it would be.
    size_t slot_of(const glm::vec3& p) const {
        const Key key = key_of(p);
        size_t slot = hash_of(key) & (table_.size() - 1);
        while (table_[slot] != nowhere && !(key_of(positions_[table_[slot]]) == key))
            slot = (slot + 1) & (table_.size() - 1);
        return slot;
    }

    std::span<const glm::vec3> positions_;
    std::vector<uint32_t> table_, first_at_;
};

}  // namespace lodestone
