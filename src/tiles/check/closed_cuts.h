// Whether tiles that are shown together are closed: every edge is run through as often one way as the other.
//
// Edges are told by the places they join, as stored, bit for bit, and not by vertices: a picture has no gap there
// whatever the vertices are. Of a tile only its border counts, the edges that do not cancel within it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "base/random.h"

namespace lodestone::tiles {

// Net times that edges are run through: key (smaller place << 32 | larger place), sorted; count above 0 from the
// smaller to the larger. None is 0.
struct BorderEdge {
    uint64_t key = 0;
    int32_t count = 0;
    bool operator==(const BorderEdge&) const = default;
};

// Ends of an edge in the way it is run through.
inline std::array<uint32_t, 2> ends_of(const BorderEdge& edge) {
    const auto low = static_cast<uint32_t>(edge.key >> 32), high = static_cast<uint32_t>(edge.key);
    return edge.count > 0 ? std::array{low, high} : std::array{high, low};
}

// Numbers of places.
class Places {
public:
    uint32_t number(const std::array<float, 3>& place);
    size_t size() const { return numbers_.size(); }

private:
    struct Hash {
        size_t operator()(const std::array<uint32_t, 3>& bits) const {
            return mix64(bits[0] ^ mix64(uint64_t{bits[1]} | uint64_t{bits[2]} << 32));
        }
    };
    std::unordered_map<std::array<uint32_t, 3>, uint32_t, Hash> numbers_;
};

// The border of triangles. corners: three places per triangle. repeated: if given, counts the edges that are run
// through more than once the same way.
std::vector<BorderEdge> border_of(std::span<const uint32_t> corners, uint64_t* repeated = nullptr);

// What is left of the borders of several.
class EdgeSum {
public:
    void add(std::span<const BorderEdge> border);
    void take(std::span<const BorderEdge> border);  // what add() would add less
    // Those that do not cancel.
    std::vector<BorderEdge> left() const;

private:
    std::unordered_map<uint64_t, int32_t> counts_;
};

}  // namespace lodestone::tiles
