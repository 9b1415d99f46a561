#include "tiles/check/closed_cuts.h"

#include <algorithm>
#include <array>
#include <bit>

namespace lodestone::tiles {

uint32_t Places::number(const std::array<float, 3>& place) {
    std::array<uint32_t, 3> bits{};
    for (size_t k = 0; k < 3; ++k) bits[k] = std::bit_cast<uint32_t>(place[k] + 0.0f);  // -0 is 0
    return numbers_.try_emplace(bits, static_cast<uint32_t>(numbers_.size())).first->second;
}

std::vector<BorderEdge> border_of(std::span<const uint32_t> corners, uint64_t* repeated) {
    // Bit 63 of a place's number is never used: it tells the way.
    struct Edge {
        uint64_t key;
        int32_t way;
        auto operator<=>(const Edge&) const = default;
    };
    std::vector<Edge> edges;
    edges.reserve(corners.size());
    for (size_t t = 0; t + 2 < corners.size(); t += 3) {
        for (size_t k = 0; k < 3; ++k) {
            const uint64_t a = corners[t + k], b = corners[t + (k + 1) % 3];
            if (a != b) edges.push_back({std::min(a, b) << 32 | std::max(a, b), a < b ? 1 : -1});
        }
    }
    std::sort(edges.begin(), edges.end());
    std::vector<BorderEdge> border;
    for (size_t i = 0; i < edges.size();) {
        BorderEdge edge{edges[i].key, 0};
        size_t ways[2] = {0, 0};
        for (; i < edges.size() && edges[i].key == edge.key; ++i) {
            edge.count += edges[i].way;
            ++ways[edges[i].way > 0 ? 1 : 0];
        }
        if (edge.count != 0) border.push_back(edge);
        if (repeated != nullptr && std::max(ways[0], ways[1]) > 1) ++*repeated;
    }
    return border;
}

void EdgeSum::add(std::span<const BorderEdge> border) {
    for (const BorderEdge& edge : border) {
        const auto [at, fresh] = counts_.try_emplace(edge.key, 0);
        at->second += edge.count;
        if (at->second == 0) counts_.erase(at);
    }
}

void EdgeSum::take(std::span<const BorderEdge> border) {
    for (const BorderEdge& edge : border) add(std::array{BorderEdge{edge.key, -edge.count}});
}

std::vector<BorderEdge> EdgeSum::left() const {
    std::vector<BorderEdge> edges;
    for (const auto& [key, count] : counts_) edges.push_back({key, count});
    std::sort(edges.begin(), edges.end(), [](const BorderEdge& a, const BorderEdge& b) { return a.key < b.key; });
    return edges;
}

}  // namespace lodestone::tiles
