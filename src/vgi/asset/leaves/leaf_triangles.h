// The triangles that a part of a leaf is drawn as, beside leaves and beside samples (leaves.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "vgi/asset/leaves/leaves.h"

namespace lodestone::vgi {

// Beside what a leaf is drawn.
struct LeafBorder {
    std::array<bool, 4> sampled{};         // by side: beside samples; then so are both its ends
    std::array<bool, 4> corner_sampled{};  // by corner: some square around it is drawn from samples
    // By side, of those beside samples: log2 of how many cells these are apart (sample_depths.h).
    std::array<uint8_t, 4> levels{};
    bool operator==(const LeafBorder&) const = default;
};

// What squares are drawn beside where all leaves are drawn.
class LeafBorders {
public:
    LeafBorders() = default;  // of no atlas
    // atlas: with leaves.
    explicit LeafBorders(const Atlas& atlas);
    // atlas: the same; square: of leaves.
    LeafBorder of(const Atlas& atlas, Atlas::Tile square) const;

private:
    std::vector<uint32_t> corners_;  // leaf_corners()
    std::vector<bool> whole_;        // per corner: all squares around it have leaves
};

template <class Own, class Sample, class Visit>
class LeafTriangles {
public:
    using Point = decltype(std::declval<const Own&>()(uint32_t{0}));

    LeafTriangles(const LeafPart& part, const LeafBorder& border, int32_t cells, const Own& own, const Sample& sample,
                  const Visit& visit)
        : part_(part),
          border_(border),
          alone_(border.sampled == std::array<bool, 4>{}),
          cells_(cells),
          own_(own),
          sample_(sample),
          visit_(visit) {}

    void all() const {
        for (const auto& triangle : part_.triangles) one(triangle);
    }

private:
    using Triangle = std::array<uint8_t, 3>;

    void emit(const Point& a, const Point& b, const Point& c) const {
        if (a != b && b != c && c != a) visit_(a, b, c);
    }

    Point point(uint32_t number) const {
        const LeafVertex& v = part_.vertices[number];
        const bool moves =
            v.is_corner() ? border_.corner_sampled[v.border - 5u] : v.border > 0 && border_.sampled[v.border - 1u];
        return moves ? sample_(v.nearest_sample(cells_)) : own_(number);
    }

    // Calls each(p, q) for the steps that an edge takes along a side beside samples, in its direction; false where it
    // is on none.
    template <class Each>
    bool walk(uint32_t from, uint32_t to, const Each& each) const {
        const LeafVertex &a = part_.vertices[from], &b = part_.vertices[to];
        if (a.border == 0 || b.border == 0) return false;
        for (uint32_t s = 0; s < 4; ++s) {
            if (!border_.sampled[s] || !a.on_side(s) || !b.on_side(s)) continue;
            GridPoint p = a.nearest_sample(cells_);
            const GridPoint end = b.nearest_sample(cells_);
            const int32_t step = 1 << border_.levels[s];
            while (!(p == end)) {
                const GridPoint q{p.x + std::clamp(end.x - p.x, -step, step),
                                  p.y + std::clamp(end.y - p.y, -step, step)};
                each(p, q);
                p = q;
            }
            return true;
        }
        return false;
    }

    // A fan around apex over the samples of the edge from corner k.
    void fan(const Triangle& t, uint32_t k, const Point& apex) const {
        walk(t[k], t[(k + 1) % 3], [&](GridPoint p, GridPoint q) { emit(apex, sample_(p), sample_(q)); });
    }

    // Around a corner of the square, where edges k and k + 1 walk: the second from the first one's begin, the first
    // from the second's next sample.
    void around_corner(const Triangle& t, uint32_t k) const {
        const Point apex = point(t[k]);
        bool first = true;
        walk(t[(k + 1) % 3], t[(k + 2) % 3], [&](GridPoint p, GridPoint q) {
            if (std::exchange(first, false)) {
                fan(t, k, sample_(q));
            } else {
                emit(apex, sample_(p), sample_(q));
            }
        });
        if (first) fan(t, k, point(t[(k + 2) % 3]));
    }

    void one(const Triangle& t) const {
        if (alone_) {
            emit(point(t[0]), point(t[1]), point(t[2]));
            return;
        }
        std::array<bool, 3> walks{};
        for (uint32_t k = 0; k < 3; ++k) walks[k] = walk(t[k], t[(k + 1) % 3], [](GridPoint, GridPoint) {});
        const int count = walks[0] + walks[1] + walks[2];
        if (count == 0) {
            emit(point(t[0]), point(t[1]), point(t[2]));
        } else if (count == 1) {
            const uint32_t k = walks[0] ? 0 : walks[1] ? 1 : 2;
            fan(t, k, point(t[(k + 2) % 3]));
        } else if (count == 2) {
            around_corner(t, !walks[0] ? 1 : !walks[1] ? 2 : 0);
        }
        // On one side with all of it: there is nothing of it beside samples.
    }

    const LeafPart& part_;
    const LeafBorder& border_;
    const bool alone_;  // no side is beside samples
    const int32_t cells_;
    const Own& own_;
    const Sample& sample_;
    const Visit& visit_;
};

// The triangles that a part is drawn as: visit(a, b, c), each own(vertex number) or sample(GridPoint). Equal points
// must have equal values; triangles that get flat are left out. cells: of a page.
template <class Own, class Sample, class Visit>
void for_drawn_triangles(const LeafPart& part, const LeafBorder& border, int32_t cells, const Own& own,
                         const Sample& sample, const Visit& visit) {
    LeafTriangles<Own, Sample, Visit>(part, border, cells, own, sample, visit).all();
}

}  // namespace lodestone::vgi
