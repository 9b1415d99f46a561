#include "vgi/asset/leaves/leaves.h"

#include <algorithm>
#include <bit>
#include <map>
#include <string>
#include <unordered_map>

#include "base/check.h"
#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/leaves/leaf_triangles.h"
#include "vgi/asset/pages.h"
#include "vgi/asset/sample_depths.h"

namespace lodestone::vgi {

Result<void> LeafPart::validate(const Atlas& atlas, uint32_t cells) const {
    const size_t materials = std::max<size_t>(1, atlas.material_table.size());
    for (const LeafVertex& v : vertices) {
        if (v.step > cells) return fail(Fault::format, "a vertex goes to a sample that there is not");
        if (atlas.attributes.materials && v.attributes.material >= materials)
            return fail(Fault::format, "names a material that there is not");
    }
    for (const auto& t : triangles) {
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return fail(Fault::format, "a triangle has a vertex twice");
    }
    return {};
}

LeafSide leaf_across(const Atlas& atlas, Atlas::Tile square, uint32_t side) {
    const uint32_t per_side = atlas.leaves_per_side(square.chart), last = per_side - 1;
    const bool inside = side == 0   ? square.y > 0
                        : side == 1 ? square.x < last
                        : side == 2 ? square.y < last
                                    : square.x > 0;
    const Atlas::Tile to = atlas.across(square, side, per_side);
    if (to.chart == ~0u) return {};
    return {atlas.leaf(to.chart, to.x, to.y),
            inside ? (side + 2) % 4 : atlas.sides[size_t{square.chart} * 4 + side].side};
}

std::vector<uint32_t> leaf_corners(const Atlas& atlas) {
    DisjointSets corners(size_t{atlas.first_leaf.back()} * 4);
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        for_leaf_squares(atlas, c, [&](const Atlas::Tile& square, uint32_t leaf) {
            for (uint32_t s = 0; s < 4; ++s) {
                const LeafSide other = leaf_across(atlas, square, s);
                if (other.leaf == ~0u) continue;
                corners.join(4 * leaf + s, 4 * other.leaf + (other.side + 1) % 4);
                corners.join(4 * leaf + (s + 1) % 4, 4 * other.leaf + other.side);
            }
        });
    }
    std::vector<uint32_t> numbers;
    for (uint32_t i = 0; i < 4 * atlas.first_leaf.back(); ++i) numbers.push_back(corners.find(i));
    return numbers;
}

LeafBorders::LeafBorders(const Atlas& atlas) : corners_(leaf_corners(atlas)), whole_(corners_.size(), true) {
    for (uint32_t i = 0; i < corners_.size(); ++i) {
        if (!atlas.has_leaf(i / 4)) whole_[corners_[i]] = false;
    }
}

LeafBorder LeafBorders::of(const Atlas& atlas, Atlas::Tile square) const {
    const uint32_t leaf = atlas.leaf(square.chart, square.x, square.y);
    LeafBorder border;
    for (uint32_t s = 0; s < 4; ++s) {
        const LeafSide other = leaf_across(atlas, square, s);
        border.sampled[s] = other.leaf != ~0u && !atlas.has_leaf(other.leaf);
        border.corner_sampled[s] = !whole_[corners_[4 * leaf + s]];
    }
    return border;
}

TexelAttributes attributes_at(const Atlas& atlas, uint32_t chart, const LeafVertex& vertex) {
    TexelAttributes is = vertex.attributes;
    if (!atlas.attributes.baked || !atlas.attributes.colours) return is;
    const uint32_t cells = atlas.attribute_cells_of(chart);
    std::array<uint32_t, 2> low{}, share{};
    for (size_t k = 0; k < 2; ++k) {
        const uint32_t at = vertex.place[k] * cells;  // in shares of a cell
        low[k] = std::min(at / leaf_places, cells - 1);
        share[k] = at - low[k] * leaf_places;
    }
    glm::u64vec4 sum(0);
    for (uint32_t corner = 0; corner < 4; ++corner) {
        const uint32_t right = corner % 2, below = corner / 2, across = right != 0 ? share[0] : leaf_places - share[0],
                       down = below != 0 ? share[1] : leaf_places - share[1];
        sum += glm::u64vec4(atlas.colours[atlas.attribute_texel(chart, low[0] + right, low[1] + below)]) *
               (uint64_t{across} * down);
    }
    constexpr uint64_t whole = uint64_t{leaf_places} * leaf_places;
    is.colour = glm::u8vec4((sum + whole / 2) / whole);
    return is;
}

LeafPart decoded_leaf(const Atlas& atlas, uint32_t part) {
    auto of = decode_leaf(atlas.leaf_parts[part], atlas.attributes);
    LODE_CHECK(of.has_value(), part);
    return std::move(*of);
}

namespace {

// An edge between two points of the leaves' lattice, the lower one first.
struct Edge {
    std::array<uint32_t, 3> low, high;
    auto operator<=>(const Edge&) const = default;
};

// Adds those that are met more often one way than the other: how many times more.
class EdgeBalance {
public:
    void add(const LeafVertex& a, const LeafVertex& b) {
        if (a.position < b.position) met_.push_back({{a.position, b.position}, 1});
        if (b.position < a.position) met_.push_back({{b.position, a.position}, -1});
    }
    void add(const EdgeBalance& other) { met_.insert(met_.end(), other.met_.begin(), other.met_.end()); }
    // Keeps one of each that is not balanced.
    void settle() {
        std::ranges::sort(met_);
        size_t kept = 0;
        for (size_t i = 0; i < met_.size();) {
            int sum = 0;
            size_t end = i;
            for (; end < met_.size() && met_[end].first == met_[i].first; ++end) sum += met_[end].second;
            const Edge edge = met_[i].first;
            i = end;
            if (sum != 0) met_[kept++] = {edge, sum};
        }
        met_.resize(kept);
    }
    bool empty() const { return met_.empty(); }

private:
    std::vector<std::pair<Edge, int>> met_;
};

// Whether vertices on sides go to samples that are there.
bool goes_to_samples(const LeafPart& part, const SquareDepths& depths) {
    return std::ranges::all_of(part.vertices, [&](const LeafVertex& v) {
        return v.border == 0 || v.is_corner() || v.step % (1u << depths.sides[v.border - 1u]) == 0;
    });
}

}  // namespace

uint64_t leaf_triangles(const Atlas& atlas) {
    uint64_t count = 0;
    for (size_t p = 0; p < atlas.leaf_parts.size(); ++p) count += triangles_in_leaf(atlas.leaf_parts[p]);
    return count;
}
double leaf_rounding(const Atlas& atlas) {
    return atlas.step / (1u << atlas.leaf_shift) * 0.8660254037844387;  // half the diagonal of a cell
}

Result<void> validate_leaves(const Atlas& atlas) {
    if (atlas.leaves.empty()) return {};
    const SampleDepths depths(atlas);
    std::vector<uint8_t> astray(atlas.charts(), 0);
    std::vector<EdgeBalance> of_charts(atlas.charts());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (auto c = static_cast<uint32_t>(begin); c < end; ++c) {
            EdgeBalance& edges = of_charts[c];
            for_leaf_squares(atlas, c, [&](const Atlas::Tile& square, uint32_t leaf) {
                for (uint32_t p = atlas.first_part(leaf); p < atlas.leaves[leaf].parts_end; ++p) {
                    const LeafPart part = decoded_leaf(atlas, p);
                    if (!goes_to_samples(part, depths.of(leaf))) astray[c] = 1;
                    for (const auto& t : part.triangles) {
                        for (uint32_t k = 0; k < 3; ++k) {
                            const LeafVertex &a = part.vertices[t[k]], &b = part.vertices[t[(k + 1) % 3]];
                            edges.add(a, b);
                            // Beyond a side that is beside no leaf there is as much as is needed.
                            for (uint32_t s = 0; s < 4 && a.border > 0; ++s) {
                                if (!a.on_side(s) || !b.on_side(s)) continue;
                                const LeafSide other = leaf_across(atlas, square, s);
                                if (other.leaf == ~0u || !atlas.has_leaf(other.leaf)) edges.add(b, a);
                            }
                        }
                    }
                }
            });
            edges.settle();
        }
    });
    EdgeBalance all;
    for (const EdgeBalance& edges : of_charts) all.add(edges);
    all.settle();
    if (std::ranges::count(astray, 1) > 0)
        return fail(Fault::invariant, "atlas: a vertex of a leaf goes to a sample that is not there");
    if (!all.empty()) return fail(Fault::invariant, "atlas: leaves do not fit together");
    return {};
}

}  // namespace lodestone::vgi
