// Whether tiles that are shown together are closed: every edge is run through as often one way as the other.
//
// Edges are told by the places they join, as stored, bit for bit, and not by vertices: a picture has no gap there
// whatever the vertices are. Of a tile only its border counts, the edges that do not cancel within it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
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
    // Those that do not cancel.
    std::vector<BorderEdge> left() const;

private:
    std::unordered_map<uint64_t, int32_t> counts_;
};

// Where an open surface ends: the border of its finest samples.
class Rim {
public:
    explicit Rim(std::span<const BorderEdge> finest);
    bool empty() const { return next_.empty(); }
    // How many edges are left that are not the rim at some level: each must lead along it, and all together must run
    // through it once. Of a closed surface every edge that is left is one.
    uint64_t gaps(std::span<const BorderEdge> left) const;

private:
    // The shortest way along the rim, places from `from` to `to`; empty where there is none of most_steps.
    std::vector<uint32_t> way(uint32_t from, uint32_t to) const;
    std::map<uint32_t, std::vector<uint32_t>> next_;  // from place to place
    size_t edges_ = 0;
};

}  // namespace lodestone::tiles
