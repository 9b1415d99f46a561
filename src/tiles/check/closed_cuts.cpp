#include "tiles/check/closed_cuts.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <deque>

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

std::vector<BorderEdge> EdgeSum::left() const {
    std::vector<BorderEdge> edges;
    for (const auto& [key, count] : counts_) edges.push_back({key, count});
    std::sort(edges.begin(), edges.end(), [](const BorderEdge& a, const BorderEdge& b) { return a.key < b.key; });
    return edges;
}

namespace {

// Ends of an edge in the way it is run through.
std::array<uint32_t, 2> ends(const BorderEdge& edge) {
    const auto low = static_cast<uint32_t>(edge.key >> 32), high = static_cast<uint32_t>(edge.key);
    return edge.count > 0 ? std::array{low, high} : std::array{high, low};
}

}  // namespace

Rim::Rim(std::span<const BorderEdge> finest) {
    for (const BorderEdge& edge : finest) {
        const auto [from, to] = ends(edge);
        for (int32_t i = 0; i < std::abs(edge.count); ++i) next_[from].push_back(to);
        edges_ += static_cast<size_t>(std::abs(edge.count));
    }
}

std::vector<uint32_t> Rim::way(uint32_t from, uint32_t to) const {
    constexpr uint32_t most_steps = 4096;  // cells along a chart
    std::map<uint32_t, uint32_t> before;
    std::deque<std::array<uint32_t, 2>> open = {{from, 0}};
    while (!open.empty()) {
        const auto [place, steps] = open.front();
        open.pop_front();
        const auto next = next_.find(place);
        if (next == next_.end() || steps == most_steps) continue;
        for (const uint32_t there : next->second) {
            if (!before.try_emplace(there, place).second) continue;
            if (there != to) {
                open.push_back({there, steps + 1});
                continue;
            }
            std::vector<uint32_t> places = {to};
            for (uint32_t at = before[to];; at = before[at]) {
                places.push_back(at);
                if (at == from) break;
            }
            std::reverse(places.begin(), places.end());
            return places;
        }
    }
    return {};
}

uint64_t Rim::gaps(std::span<const BorderEdge> left) const {
    uint64_t gaps = 0;
    size_t run = 0;
    std::map<std::array<uint32_t, 2>, int> times;
    for (const BorderEdge& edge : left) {
        const auto [from, to] = ends(edge);
        const std::vector<uint32_t> places = way(from, to);
        if (places.empty()) {
            gaps += static_cast<uint64_t>(std::abs(edge.count));
            continue;
        }
        for (size_t i = 0; i + 1 < places.size(); ++i) times[{places[i], places[i + 1]}] += std::abs(edge.count);
    }
    for (const auto& [edge, count] : times) {
        run += static_cast<size_t>(count);
        if (count > 1) gaps += static_cast<uint64_t>(count - 1);
    }
    return gaps + (run < edges_ ? edges_ - run : 0);
}

}  // namespace lodestone::tiles
