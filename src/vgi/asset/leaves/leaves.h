// Leaves of an atlas: below the finest samples, the source's own triangles. A leaf is the part of the source that lies
// in the square of a finest page (pages.h) of a chart: its triangles clipped to the square in the chart's parameters.
// The map of a chart is linear on each of them, so the pieces are the surface itself, attributes included.
//
// A leaf's triangles meet each side of its square in the places where edges of the source cross it, and in its two
// corners. What lies across shares them: beside another leaf nothing moves. Beside samples every such place goes to the
// nearest sample of the side that is there (sample_depths.h), and the triangle that has the edge between two of them
// becomes a fan over the samples from the one's to the other's: then all that the side has is samples, in order,
// whatever the source has there.
//
// Leaves are stored as parts, each of few enough triangles and vertices for a slot of a pool. Parts of a leaf share
// points bit for bit, as leaves do.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec4.hpp>
#include <span>
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
    std::array<uint8_t, 3> surface{255, 255, 255}, emission{255, 255, 255};  // of samples alone: leaves have none
    uint16_t material = 0;
    bool operator==(const TexelAttributes&) const = default;
};

struct LeafVertex {
    std::array<uint32_t, 3> position{};  // of the leaves' lattice: Atlas::leaf_point()
    std::array<uint16_t, 2> place{};     // in the chart, 0 .. leaf_places
    // 0: inside the square; 1 + s: on side s; 5 + k: corner k, where side k begins.
    uint8_t border = 0;
    uint8_t step = 0;            // on a side: the nearest sample, by its x or y in the page; else 0
    TexelAttributes attributes;  // what leaves hold of them
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

// Of a vertex of a leaf of a chart. Colours of baked textures are those of the samples around its place; leaves do not
// hold them. atlas: with its samples.
TexelAttributes attributes_at(const Atlas& atlas, uint32_t chart, const LeafVertex& vertex);

// Part number `part` of an atlas that is whole and good (open_atlas).
LeafPart decoded_leaf(const Atlas& atlas, uint32_t part);

// Calls visit(square, its number) for all squares of leaves of a chart.
template <class Visit>
void for_leaf_squares(const Atlas& atlas, uint32_t chart, Visit&& visit) {
    const uint32_t per_side = atlas.leaves_per_side(chart);
    for (uint32_t y = 0; y < per_side; ++y) {
        for (uint32_t x = 0; x < per_side; ++x) visit(Atlas::Tile{chart, x, y}, atlas.leaf(chart, x, y));
    }
}

// The square across a side of one, and the side of it that lies there; leaf is ~0 where the surface ends.
struct LeafSide {
    uint32_t leaf = ~0u, side = 0;
};
// Of square (x, y) of a chart.
LeafSide leaf_across(const Atlas& atlas, Atlas::Tile square, uint32_t side);
// Which corners of squares are one point: a number, 0 .. , for corner k of square i at 4 i + k, the lowest of those
// that are one.
std::vector<uint32_t> leaf_corners(const Atlas& atlas);

uint64_t leaf_triangles(const Atlas& atlas);  // of all leaves, as they are stored
double leaf_rounding(const Atlas& atlas);     // how far their points may be from the source's; object units

// Whether leaves fit together: every edge as often each way, but on sides that are beside no leaf. Fault::invariant.
Result<void> validate_leaves(const Atlas& atlas);

}  // namespace lodestone::vgi
