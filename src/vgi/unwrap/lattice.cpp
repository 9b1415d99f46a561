#include "vgi/unwrap/lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <utility>

#include "base/threads.h"

namespace lodestone::vgi {

namespace {

constexpr int most_passes = 60;  // over what is turned over in a chart

// A chart while it is mended.
class Mending {
public:
    Mending(const ChartMesh& patch, std::vector<LatticePoint>& points)
        : patch_(patch), points_(points), rim_(patch.on_boundary()) {}

    // How many are left.
    uint32_t run() {
        std::vector<uint32_t> bad = find_bad();
        if (bad.empty()) return 0;
        list_corners();
        for (int pass = 0; pass < most_passes && !bad.empty(); ++pass) {
            for (const uint32_t t : bad) {
                for (const uint32_t v : patch_.triangles[t].vertices) {
                    if (!rim_[v]) move(v);
                }
            }
            bad = find_bad();
        }
        return static_cast<uint32_t>(bad.size());
    }

private:
    int64_t area_of(uint32_t t) const {
        const auto& v = patch_.triangles[t].vertices;
        return twice_area(points_[v[0]], points_[v[1]], points_[v[2]]);
    }
    std::vector<uint32_t> find_bad() const {
        std::vector<uint32_t> bad;
        for (uint32_t t = 0; t < patch_.triangles.size(); ++t) {
            if (area_of(t) <= 0) bad.push_back(t);
        }
        return bad;
    }
    void list_corners() {
        first_.assign(points_.size() + 1, 0);
        for (const SurfaceTriangle& t : patch_.triangles) {
            for (const uint32_t v : t.vertices) ++first_[v + 1];
        }
        for (size_t v = 0; v < points_.size(); ++v) first_[v + 1] += first_[v];
        around_.resize(first_.back());
        std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
        for (uint32_t t = 0; t < patch_.triangles.size(); ++t) {
            for (const uint32_t v : patch_.triangles[t].vertices) around_[next[v]++] = t;
        }
    }
    std::span<const uint32_t> around(uint32_t v) const {
        return std::span(around_).subspan(first_[v], first_[v + 1] - first_[v]);
    }
    // Of the triangles around a vertex.
    int64_t least_area(uint32_t v) const {
        int64_t least = lattice_side * lattice_side;
        for (const uint32_t t : around(v)) least = std::min(least, area_of(t));
        return least;
    }

    // To where the smallest triangle around it is largest, of some places.
    void move(uint32_t v) {
        LatticePoint low = points_[v], high = low, middle(0);
        int64_t count = 0;
        for (const uint32_t t : around(v)) {
            for (const uint32_t w : patch_.triangles[t].vertices) {
                if (w == v) continue;
                middle += points_[w];
                ++count;
                low = glm::min(low, points_[w]);
                high = glm::max(high, points_[w]);
            }
        }
        LatticePoint best = points_[v];
        int64_t area = least_area(v);
        const auto attempt = [&](const LatticePoint& at) {
            points_[v] = at;
            const int64_t now = least_area(v);
            if (now > area) {
                area = now;
                best = at;
            }
        };
        attempt(middle / count);
        attempt((middle / count + best) / int64_t{2});
        static constexpr std::array<std::array<int64_t, 2>, 8> ways = {
            {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}}};
        for (int64_t step = std::max(high.x - low.x, high.y - low.y) / 2 + 1; step > 0; step /= 2) {
            const LatticePoint from = best;
            for (const auto& way : ways) attempt(from + LatticePoint(way[0], way[1]) * step);
        }
        points_[v] = best;
    }

    const ChartMesh& patch_;
    std::vector<LatticePoint>& points_;
    const std::vector<bool> rim_;
    std::vector<uint32_t> first_, around_;  // triangles around vertices
};

LatticePoint corner_of(double x, double y) {
    return {std::llround(x * static_cast<double>(lattice_side)), std::llround(y * static_cast<double>(lattice_side))};
}

// Whether a line along an edge of `a` has all of `b` on the other side or on it.
bool separates(const LatticeTriangle& a, const LatticeTriangle& b) {
    for (int k = 0; k < 3; ++k) {
        const LatticePoint &from = a.corners[k], &to = a.corners[(k + 1) % 3];
        if (std::ranges::all_of(b.corners, [&](const LatticePoint& p) { return twice_area(from, to, p) <= 0; }))
            return true;
    }
    return false;
}

struct Window {
    LatticePoint low{0}, high{lattice_side};
};
Window window_of(const LatticeTriangle& t) {
    return {glm::min(glm::min(t.corners[0], t.corners[1]), t.corners[2]),
            glm::max(glm::max(t.corners[0], t.corners[1]), t.corners[2])};
}

// Finds pairs in parts of a square that are halved until few triangles are in each; in several parts maybe.
using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;
class PairSearch {
public:
    explicit PairSearch(std::span<const LatticeTriangle> triangles) : triangles_(triangles) {}

    void in(const Window& part, const std::vector<uint32_t>& members, int depth, Pairs& found) const {
        constexpr size_t few = 24, many = 512;
        constexpr int deepest = 22;
        if (members.size() <= few || depth >= deepest) return among(members, found);
        const LatticePoint middle = (part.low + part.high) / int64_t{2};
        std::array<Window, 4> quarters;
        std::array<std::vector<uint32_t>, 4> inside;
        size_t most = 0;
        for (size_t q = 0; q < 4; ++q) {
            quarters[q] = part;
            (q % 2 == 0 ? quarters[q].high : quarters[q].low).x = middle.x;
            (q / 2 == 0 ? quarters[q].high : quarters[q].low).y = middle.y;
            for (const uint32_t t : members) {
                if (meets(triangles_[t], quarters[q])) inside[q].push_back(t);
            }
            most = std::max(most, inside[q].size());
        }
        // Many triangles around one vertex stay together.
        if (members.size() <= many && most * 4 > members.size() * 3) return among(members, found);
        for (size_t q = 0; q < 4; ++q) in(quarters[q], inside[q], depth + 1, found);
    }
    // Parts hold their low sides, not their high ones.
    static bool touch(const Window& a, const Window& part) {
        return a.low.x < part.high.x && a.high.x >= part.low.x && a.low.y < part.high.y && a.high.y >= part.low.y;
    }

private:
    // Whether the triangle, not only its window, reaches into the part.
    static bool meets(const LatticeTriangle& t, const Window& part) {
        if (!touch(window_of(t), part)) return false;
        const LatticePoint at[4] = {part.low, {part.high.x, part.low.y}, part.high, {part.low.x, part.high.y}};
        for (int k = 0; k < 3; ++k) {
            const LatticePoint &from = t.corners[k], &to = t.corners[(k + 1) % 3];
            if (std::ranges::all_of(at, [&](const LatticePoint& p) { return twice_area(from, to, p) < 0; }))
                return false;
        }
        return true;
    }

    void among(const std::vector<uint32_t>& members, Pairs& found) const {
        for (size_t i = 0; i < members.size(); ++i) {
            const LatticeTriangle& a = triangles_[members[i]];
            const Window of_a = window_of(a);
            for (size_t j = i + 1; j < members.size(); ++j) {
                const LatticeTriangle& b = triangles_[members[j]];
                const Window of_b = window_of(b);
                const LatticePoint low = glm::max(of_a.low, of_b.low), high = glm::min(of_a.high, of_b.high);
                if (low.x >= high.x || low.y >= high.y || separates(a, b) || separates(b, a)) continue;
                found.emplace_back(members[i], members[j]);
            }
        }
    }

    const std::span<const LatticeTriangle> triangles_;
};

}  // namespace

std::vector<LatticePoint> onto_lattice(const FlatChart& chart, const PackedRectangle& place, uint32_t& left) {
    const LatticePoint low = corner_of(place.x, place.y);
    const LatticePoint size = glm::max(corner_of(place.x + place.width, place.y + place.height) - low, LatticePoint(1));
    std::vector<LatticePoint> points;
    points.reserve(chart.patch.flat.size());
    for (const glm::dvec2& flat : chart.patch.flat) {
        const glm::dvec2 at = place.turned ? glm::dvec2(1 - flat.y, flat.x) : flat;
        points.push_back(low + LatticePoint(std::llround(at.x * static_cast<double>(size.x)),
                                            std::llround(at.y * static_cast<double>(size.y))));
    }
    left = Mending(chart.patch, points).run();
    return points;
}

LatticeFaults faults_of(std::span<const LatticeTriangle> triangles, uint32_t squares) {
    constexpr uint32_t tiles = 32;  // along a side
    LatticeFaults faults;
    std::vector<std::vector<uint32_t>> in_tile(size_t{squares} * tiles * tiles);
    const auto tile = [](int64_t at) {
        return static_cast<uint32_t>(std::clamp<int64_t>(at / (lattice_side / tiles), 0, tiles - 1));
    };
    for (uint32_t t = 0; t < triangles.size(); ++t) {
        const LatticeTriangle& triangle = triangles[t];
        if (twice_area(triangle.corners[0], triangle.corners[1], triangle.corners[2]) <= 0) {
            ++faults.flipped;  // and not looked at for overlaps: it has no inside
            continue;
        }
        const Window w = window_of(triangle);
        for (uint32_t y = tile(w.low.y); y <= tile(w.high.y); ++y) {
            for (uint32_t x = tile(w.low.x); x <= tile(w.high.x); ++x)
                in_tile[(size_t{triangle.square} * tiles + y) * tiles + x].push_back(t);
        }
    }
    std::vector<Pairs> overlapping(in_tile.size());
    parallel_for(in_tile.size(), 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const int64_t x = static_cast<int64_t>(i % tiles), y = static_cast<int64_t>(i / tiles % tiles);
            constexpr int64_t side = lattice_side / tiles;
            // What lies on the square's far sides belongs to its last tiles.
            const auto far = [&](int64_t at) { return at + 1 == tiles ? lattice_side + 1 : (at + 1) * side; };
            const Window part{LatticePoint(x * side, y * side), LatticePoint(far(x), far(y))};
            PairSearch(triangles).in(part, in_tile[i], 5, overlapping[i]);
        }
    });
    Pairs all;
    for (const Pairs& pairs : overlapping) all.insert(all.end(), pairs.begin(), pairs.end());
    std::ranges::sort(all);
    faults.overlapping = static_cast<uint64_t>(std::unique(all.begin(), all.end()) - all.begin());
    return faults;
}

}  // namespace lodestone::vgi
