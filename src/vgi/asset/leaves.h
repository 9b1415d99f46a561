// Leaves of an atlas: below the finest samples, the source's own triangles. A leaf is the part of the source that lies
// in the square of a finest page (pages.h) of a chart: its triangles clipped to the square in the chart's parameters.
// The map of a chart is linear on each of them, so the pieces are the surface itself, attributes included.
//
// A leaf's triangles meet each side of its square in the places where edges of the source cross it, and in its two
// corners. What lies across shares them: beside another leaf nothing moves. Beside samples every such place goes to the
// nearest sample of the side, and the triangle that has the edge between two of them becomes a fan over the samples
// from the one's to the other's: then all that the side has is samples, in order, whatever the source has there.
//
// Leaves are stored as parts, each of few enough triangles and vertices for a slot of a pool. Parts of a leaf share
// points bit for bit, as leaves do.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
#include <utility>
#include <vector>

#include "base/result.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/asset/atlas.h"
#include "vgi/asset/bintree.h"

namespace lodestone::vgi {

inline constexpr uint32_t most_leaf_triangles = 512;                        // of a part
inline constexpr uint32_t most_leaf_vertices = LODE_VGI_LEAF_VERTICES - 1;  // of a part
inline constexpr uint32_t leaf_bits = 21;                                   // of a coordinate of a leaf's vertex
inline constexpr uint32_t most_leaf_shift = leaf_bits - 1;                  // Atlas::leaf_shift
inline constexpr uint32_t leaf_places = 8192;                               // in a chart, along a side

// As texels of the images of attributes have them (Atlas); what the atlas has not is as here.
struct TexelAttributes {
    std::array<int8_t, 2> normal{};
    std::array<uint16_t, 2> uv{};
    glm::u8vec4 colour{255};
    uint16_t material = 0;
    bool operator==(const TexelAttributes&) const = default;
};

struct LeafVertex {
    std::array<uint32_t, 3> position{};  // of the leaves' lattice: Atlas::leaf_point()
    std::array<uint16_t, 2> place{};     // in the chart, 0 .. leaf_places
    // 0: inside the square; 1 + s: on side s; 5 + k: corner k, where side k begins.
    uint8_t border = 0;
    uint8_t step = 0;  // on a side: the nearest sample, by its x or y in the page; else 0
    TexelAttributes attributes;
    bool operator==(const LeafVertex&) const = default;

    bool is_corner() const { return border >= 5; }
    // Whether it lies on side s, 0 .. 3, ends included.
    bool on_side(uint32_t s) const {
        return border == 1 + s || (is_corner() && (border - 5u == s || border - 5u == (s + 1) % 4));
    }
    // The sample that it goes to beside samples; of one on a side. cells: of a page.
    GridPoint nearest_sample(int32_t cells) const {
        if (is_corner()) {
            const auto [x, y] = vgi::on_side(border - 5u, 0, cells);
            return {x, y};
        }
        const int32_t along = step;
        switch (border) {
            case 1:
                return {along, 0};
            case 2:
                return {cells, along};
            case 3:
                return {along, cells};
            default:
                return {0, along};
        }
    }
};

// Some of a leaf's triangles, counter-clockwise seen from outside.
struct LeafPart {
    std::vector<LeafVertex> vertices;
    std::vector<std::array<uint8_t, 3>> triangles;
    bool operator==(const LeafPart&) const = default;

    // Numbers in range. cells: of a page. Fault::format.
    Result<void> validate(const Atlas& atlas, uint32_t cells) const;
};
static_assert(most_leaf_vertices <= 256);

// How many triangles a coded part has, as its beginning says; 0 of fewer bytes.
inline constexpr size_t leaf_header_bytes = 3;
inline uint32_t triangles_in_leaf(std::span<const std::byte> begin) {
    return begin.size() < leaf_header_bytes ? 0
                                            : static_cast<uint32_t>(begin[1]) | static_cast<uint32_t>(begin[2]) << 8;
}

// What is coded. Vertices must be numbered in the order that triangles first use them.
std::vector<std::byte> encode_leaf(const LeafPart& part, const PresentAttributes& attributes);
// Fault::format where the bytes are those of no part.
Result<LeafPart> decode_leaf(std::span<const std::byte> bytes, const PresentAttributes& attributes);

// Beside what a leaf is drawn.
struct LeafBorder {
    std::array<bool, 4> sampled{};         // by side: beside samples; then so are both its ends
    std::array<bool, 4> corner_sampled{};  // by corner: some square around it is drawn from samples
};

// The triangles that a part is drawn as: visit(a, b, c), each own(vertex number) or sample(GridPoint). Equal points
// must have equal values; triangles that get flat are left out. cells: of a page.
template <class Own, class Sample, class Visit>
void for_drawn_triangles(const LeafPart& part, const LeafBorder& border, int32_t cells, const Own& own,
                         const Sample& sample, const Visit& visit);

// The square across a side of one, and the side of it that lies there; leaf is ~0 where the surface ends.
struct LeafSide {
    uint32_t leaf = ~0u, side = 0;
};
// Of square (x, y) of a chart.
LeafSide leaf_across(const Atlas& atlas, Atlas::Tile square, uint32_t side);
// Which corners of squares are one point: a number, 0 .. , for corner k of square i at 4 i + k, the lowest of those
// that are one.
std::vector<uint32_t> leaf_corners(const Atlas& atlas);

// The source surface as one mesh: what glued leaves share is one vertex; squares without a leaf are as their finest
// samples have them. Decodes all leaves, which must be good (open_atlas).
TriMesh extract_leaves(const Atlas& atlas);

uint64_t leaf_triangles(const Atlas& atlas);  // of all leaves, as they are stored
double leaf_rounding(const Atlas& atlas);     // how far their points may be from the source's; object units

// Whether leaves fit together: every edge as often each way, but on sides that are beside no leaf. Fault::invariant.
Result<void> validate_leaves(const Atlas& atlas);

template <class Own, class Sample, class Visit>
void for_drawn_triangles(const LeafPart& part, const LeafBorder& border, int32_t cells, const Own& own,
                         const Sample& sample, const Visit& visit) {
    using Point = decltype(own(uint32_t{0}));
    const auto emit = [&](const Point& a, const Point& b, const Point& c) {
        if (a != b && b != c && c != a) visit(a, b, c);
    };
    const auto point = [&](uint32_t number) -> Point {
        const LeafVertex& v = part.vertices[number];
        const bool moves =
            v.is_corner() ? border.corner_sampled[v.border - 5u] : v.border > 0 && border.sampled[v.border - 1u];
        return moves ? sample(v.nearest_sample(cells)) : own(number);
    };
    // Calls each(p, q) for the steps that an edge takes along a side beside samples, in its direction; false where it
    // is on none.
    const auto walk = [&](uint32_t from, uint32_t to, const auto& each) {
        const LeafVertex &a = part.vertices[from], &b = part.vertices[to];
        if (a.border == 0 || b.border == 0) return false;
        for (uint32_t s = 0; s < 4; ++s) {
            if (!border.sampled[s] || !a.on_side(s) || !b.on_side(s)) continue;
            GridPoint p = a.nearest_sample(cells);
            const GridPoint end = b.nearest_sample(cells);
            while (!(p == end)) {
                const GridPoint q{p.x + (end.x > p.x) - (end.x < p.x), p.y + (end.y > p.y) - (end.y < p.y)};
                each(p, q);
                p = q;
            }
            return true;
        }
        return false;
    };
    const auto nothing = [](GridPoint, GridPoint) {};
    for (const auto& t : part.triangles) {
        std::array<bool, 3> walks{};
        for (uint32_t k = 0; k < 3; ++k) walks[k] = walk(t[k], t[(k + 1) % 3], nothing);
        const int count = walks[0] + walks[1] + walks[2];
        if (count == 0) {
            emit(point(t[0]), point(t[1]), point(t[2]));
        } else if (count == 1) {
            const uint32_t k = walks[0] ? 0 : walks[1] ? 1 : 2;
            const Point apex = point(t[(k + 2) % 3]);
            walk(t[k], t[(k + 1) % 3], [&](GridPoint p, GridPoint q) { emit(apex, sample(p), sample(q)); });
        } else if (count == 2) {
            // Around a corner of the square: the second edge from the first one's begin, the first from its next
            // sample.
            const uint32_t k = !walks[0] ? 1 : !walks[1] ? 2 : 0;
            const Point apex = point(t[k]), last = point(t[(k + 2) % 3]);
            const auto first_edge = [&](const Point& from) {
                walk(t[k], t[(k + 1) % 3], [&](GridPoint u, GridPoint v) { emit(from, sample(u), sample(v)); });
            };
            bool first = true;
            walk(t[(k + 1) % 3], t[(k + 2) % 3], [&](GridPoint p, GridPoint q) {
                if (std::exchange(first, false)) {
                    first_edge(sample(q));
                } else {
                    emit(apex, sample(p), sample(q));
                }
            });
            if (first) first_edge(last);
        }
        // On one side with all of it: there is nothing of it beside samples.
    }
}

}  // namespace lodestone::vgi
