#include "tiles/check/rim.h"

#include <algorithm>
#include <cstdlib>
#include <queue>
#include <unordered_set>

#include "base/structures/disjoint_sets.h"

namespace lodestone::tiles {

namespace {

constexpr uint32_t most_steps = 4096;  // cells along a chart
constexpr int most_rounds = 32;        // in which ways give way to each other
constexpr uint64_t crowding = 16;      // steps of a detour that one more in the same place is worth, more each round

// An edge that is left over, and the way along the rim that it stands for.
struct Way {
    uint32_t from = 0, to = 0;
    std::vector<uint32_t> edges;  // of the rim; none while there is none
};

// Lays ways along a rim.
class Ways {
public:
    explicit Ways(const Rim& rim) : rim_(rim), taken_(rim.edges().size(), 0), dearer_(rim.edges().size(), 0) {}

    // Edges without a way.
    uint64_t lay_all(std::span<const BorderEdge> left) {
        uint64_t without = 0;
        for (const BorderEdge& edge : left) {
            const auto [from, to] = ends_of(edge);
            for (int32_t i = 0; i < std::abs(edge.count); ++i) {
                ways_.push_back({from, to, {}});
                if (!lay(ways_.back())) ++without;
            }
        }
        for (int round = 0; round < most_rounds && make_room(); ++round) lay_again();
        return without;
    }
    // How often an edge of the rim is run through.
    uint32_t taken(uint32_t edge) const { return taken_[edge]; }

private:
    bool crowded(uint32_t edge) const { return taken_[edge] > rim_.edges()[edge].times; }

    // The cheapest way: each edge is one step, and more where ways were too many, the more so where it is taken.
    bool lay(Way& way) {
        struct Reached {
            uint64_t cost = 0;
            uint32_t edge = 0, steps = 0;  // the edge that leads there
            bool operator>(const Reached& other) const { return cost > other.cost; }
        };
        std::unordered_map<uint32_t, uint32_t> by;  // place, and the edge of the cheapest way there
        std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
        const auto go_on = [&](uint32_t place, uint64_t cost, uint32_t steps) {
            for (const uint32_t edge : rim_.from(place)) open.push({cost + cost_of(edge), edge, steps + 1});
        };
        go_on(way.from, 0, 0);
        while (!open.empty()) {
            const Reached at = open.top();
            open.pop();
            const uint32_t place = rim_.edges()[at.edge].to;
            if (!by.try_emplace(place, at.edge).second) continue;
            if (place == way.to) {
                take(way, by);
                return true;
            }
            if (at.steps < most_steps) go_on(place, at.cost, at.steps);
        }
        return false;
    }
    uint64_t cost_of(uint32_t edge) const {
        return 1 + dearer_[edge] * (taken_[edge] < rim_.edges()[edge].times ? 1 : 2);
    }
    void take(Way& way, const std::unordered_map<uint32_t, uint32_t>& by) {
        for (uint32_t place = way.to; way.edges.empty() || place != way.from;) {
            const uint32_t edge = by.at(place);
            way.edges.push_back(edge);
            ++taken_[edge];
            place = rim_.edges()[edge].from;
        }
    }

    // Takes up all ways where there are too many; false where there are none.
    bool make_room() {
        moving_.clear();
        for (uint32_t w = 0; w < ways_.size(); ++w) {
            if (std::ranges::any_of(ways_[w].edges, [&](uint32_t edge) { return crowded(edge); })) moving_.push_back(w);
        }
        for (uint32_t edge = 0; edge < taken_.size(); ++edge) dearer_[edge] += crowded(edge) ? crowding : 0;
        // Short ones have the least choice.
        std::ranges::stable_sort(moving_, {}, [&](uint32_t w) { return ways_[w].edges.size(); });
        for (const uint32_t w : moving_) {
            for (const uint32_t edge : ways_[w].edges) --taken_[edge];
            ways_[w].edges.clear();
        }
        return !moving_.empty();
    }
    void lay_again() {
        for (const uint32_t w : moving_) lay(ways_[w]);
    }

    const Rim& rim_;
    std::vector<uint32_t> taken_;   // per edge of the rim
    std::vector<uint64_t> dearer_;  // per edge: steps that it counts for besides its own
    std::vector<Way> ways_;
    std::vector<uint32_t> moving_;  // into ways_
};

// What no way leads along, in pieces that hang together.
class Untaken {
public:
    Untaken(const Rim& rim, const Ways& ways) : rim_(rim) {
        for (uint32_t i = 0; i < rim.edges().size(); ++i) {
            const Rim::Edge& edge = rim.edges()[i];
            if (ways.taken(i) >= edge.times) continue;
            edges_.push_back({edge.from, edge.to, edge.times - ways.taken(i)});
            number(edge.from);
            number(edge.to);
        }
        DisjointSets joined(static_cast<uint32_t>(numbers_.size()));
        for (const Rim::Edge& edge : edges_) joined.join(numbers_.at(edge.from), numbers_.at(edge.to));
        pieces_.resize(numbers_.size());
        for (const auto& [place, i] : numbers_) piece_.emplace(place, joined.find(i));
    }

    // Of pieces that no triangle is at, that are no rings, and of holes that are filled.
    uint64_t gaps(std::span<const uint32_t> shown) {
        std::unordered_map<uint32_t, std::array<uint32_t, 2>> through;  // edges that leave a place and that arrive
        for (const Rim::Edge& edge : edges_) {
            piece_of(edge.from).edges += edge.times;
            through[edge.from][0] += edge.times;
            through[edge.to][1] += edge.times;
        }
        for (const auto& [place, times] : through) {
            piece_of(place).branches |= times[0] > 1;
            piece_of(place).ends |= times[0] != times[1];
        }
        for (const uint32_t place : std::unordered_set<uint32_t>(shown.begin(), shown.end())) {
            if (!numbers_.contains(place)) continue;
            piece_of(place).shown = true;
            // Where rims touch, the corner may be of the other.
            const auto leaving = rim_.from(place);
            if (leaving.size() == 1 && rim_.edges()[leaving[0]].times == 1) ++piece_of(place).corners;
        }
        uint64_t gaps = 0;
        for (const Piece& piece : pieces_) gaps += piece.closed() ? 0 : piece.edges;
        return gaps;
    }

private:
    struct Piece {
        uint64_t edges = 0;
        uint32_t corners = 0;  // places of it alone that tiles show
        bool shown = false, ends = false, branches = false;
        // A ring of edges between more than two places does not cancel by itself.
        bool closed() const { return shown && !ends && (branches || corners <= 2); }
    };
    void number(uint32_t place) { numbers_.try_emplace(place, static_cast<uint32_t>(numbers_.size())); }
    Piece& piece_of(uint32_t place) { return pieces_[piece_.at(place)]; }

    const Rim& rim_;
    std::vector<Rim::Edge> edges_;                            // as many times as they are not taken
    std::unordered_map<uint32_t, uint32_t> numbers_, piece_;  // of places
    std::vector<Piece> pieces_;
};

}  // namespace

Rim::Rim(std::span<const BorderEdge> finest) {
    for (const BorderEdge& edge : finest) {
        const auto [from, to] = ends_of(edge);
        edges_.push_back({from, to, static_cast<uint32_t>(std::abs(edge.count))});
    }
    std::ranges::sort(edges_, {}, [](const Edge& edge) { return std::array{edge.from, edge.to}; });
    for (uint32_t i = 0; i < edges_.size(); ++i) from_[edges_[i].from].push_back(i);
}

std::span<const uint32_t> Rim::from(uint32_t place) const {
    const auto at = from_.find(place);
    return at == from_.end() ? std::span<const uint32_t>{} : std::span<const uint32_t>(at->second);
}

std::vector<uint32_t> Rim::places_among(std::span<const uint32_t> corners) const {
    std::vector<uint32_t> places;
    for (const uint32_t place : corners) {
        if (from_.contains(place)) places.push_back(place);
    }
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    return places;
}

uint64_t Rim::gaps(std::span<const BorderEdge> left, std::span<const uint32_t> shown) const {
    Ways ways(*this);
    uint64_t gaps = ways.lay_all(left);
    for (uint32_t i = 0; i < edges_.size(); ++i) {
        if (ways.taken(i) > edges_[i].times) gaps += ways.taken(i) - edges_[i].times;
    }
    return gaps + Untaken(*this, ways).gaps(shown);
}

}  // namespace lodestone::tiles
