#include "vgi/asset/leaves.h"

#include <algorithm>
#include <bit>
#include <map>
#include <string>
#include <unordered_map>

#include "base/check.h"
#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/leaf_triangles.h"
#include "vgi/asset/pages.h"

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

namespace {

// Calls visit(square, its number) for all squares of leaves.
template <class Visit>
void for_squares(const Atlas& atlas, uint32_t chart, Visit&& visit) {
    const uint32_t per_side = atlas.leaves_per_side(chart);
    for (uint32_t y = 0; y < per_side; ++y) {
        for (uint32_t x = 0; x < per_side; ++x) visit(Atlas::Tile{chart, x, y}, atlas.leaf(chart, x, y));
    }
}

}  // namespace

std::vector<uint32_t> leaf_corners(const Atlas& atlas) {
    DisjointSets corners(size_t{atlas.first_leaf.back()} * 4);
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        for_squares(atlas, c, [&](const Atlas::Tile& square, uint32_t leaf) {
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

// The source as a mesh. Points are numbered by where they are on the leaves' lattice, on which all samples lie, too.
class SourceExtraction {
public:
    explicit SourceExtraction(const Atlas& atlas) : atlas_(atlas), borders_(atlas) {}

    TriMesh run() {
        mesh_.material_table = atlas_.material_table;
        mesh_.images = atlas_.images;
        for (uint32_t c = 0; c < atlas_.charts(); ++c) {
            for_squares(atlas_, c, [&](const Atlas::Tile& square, uint32_t leaf) {
                square_ = square;
                if (atlas_.has_leaf(leaf)) {
                    add_leaf(leaf);
                } else {
                    add_samples();
                }
            });
        }
        return std::move(mesh_);
    }

private:
    // Of a part's vertex, or of a sample of the square: the wedge it is drawn as.
    void add_leaf(uint32_t leaf) {
        const LeafBorder border = borders_.of(atlas_, square_);
        const auto cells = static_cast<int32_t>(tree_of(atlas_, Layer::geometry, square_.chart).cells_per_page());
        for (uint32_t p = atlas_.first_part(leaf); p < atlas_.leaves[leaf].parts_end; ++p) {
            const LeafPart part = decoded_leaf(atlas_, p);
            for_drawn_triangles(
                part, border, cells,
                [&](uint32_t v) {
                    const LeafVertex& vertex = part.vertices[v];
                    return wedge(vertex.position, attributes_at(atlas_, square_.chart, vertex));
                },
                [&](GridPoint at) { return sample(at); },
                [&](uint32_t a, uint32_t b, uint32_t c) { add_triangle(a, b, c); });
        }
    }

    void add_samples() {
        const auto cells = static_cast<int32_t>(tree_of(atlas_, Layer::geometry, square_.chart).cells_per_page());
        for (int32_t y = 0; y < cells; ++y) {
            for (int32_t x = 0; x < cells; ++x) {
                const uint32_t a = sample({x, y}), b = sample({x + 1, y}), c = sample({x + 1, y + 1}),
                               d = sample({x, y + 1});
                const bool rising = rising_diagonal(static_cast<uint32_t>(x), static_cast<uint32_t>(y));
                for (const auto& t : cell_triangles(rising, a, b, c, d)) add_triangle(t[0], t[1], t[2]);
            }
        }
    }

    void add_triangle(uint32_t a, uint32_t b, uint32_t c) {
        const uint32_t i = mesh_.wedge_vertex[a], j = mesh_.wedge_vertex[b], k = mesh_.wedge_vertex[c];
        if (i != j && j != k && k != i) mesh_.triangles.push_back({a, b, c});
    }

    uint32_t sample(GridPoint at) {
        const uint32_t cells = tree_of(atlas_, Layer::geometry, square_.chart).cells_per_page(),
                       x = square_.x * cells + static_cast<uint32_t>(at.x),
                       y = square_.y * cells + static_cast<uint32_t>(at.y),
                       ratio = atlas_.attribute_ratio_of(square_.chart);
        const auto& p = atlas_.positions[atlas_.texel(square_.chart, x, y)];
        const size_t texel = atlas_.attribute_texel(square_.chart, x * ratio, y * ratio);
        TexelAttributes attributes;
        attributes.normal = atlas_.normals[texel];
        if (!atlas_.uvs.empty()) attributes.uv = atlas_.uvs[texel];
        if (!atlas_.colours.empty()) attributes.colour = atlas_.colours[texel];
        if (!atlas_.materials.empty()) attributes.material = atlas_.materials[texel];
        return wedge({uint32_t{p[0]} << atlas_.leaf_shift, uint32_t{p[1]} << atlas_.leaf_shift,
                      uint32_t{p[2]} << atlas_.leaf_shift},
                     attributes);
    }

    uint32_t wedge(const std::array<uint32_t, 3>& position, const TexelAttributes& attributes) {
        const uint64_t key =
            uint64_t{position[0]} << (2 * leaf_bits) | uint64_t{position[1]} << leaf_bits | position[2];
        const auto [at, fresh] = vertices_.try_emplace(key, static_cast<uint32_t>(mesh_.positions.size()));
        if (fresh) {
            mesh_.positions.emplace_back(atlas_.leaf_point(position));
            wedges_of_.emplace_back(~0u);
        }
        uint32_t* last = &wedges_of_[at->second];
        while (*last != ~0u) {
            if (attributes_[*last] == attributes) return *last;
            last = &next_wedge_[*last];
        }
        *last = static_cast<uint32_t>(mesh_.wedge_vertex.size());
        const uint32_t number = *last;
        add_wedge(at->second, attributes);
        return number;
    }
    void add_wedge(uint32_t vertex, const TexelAttributes& attributes) {
        next_wedge_.push_back(~0u);
        attributes_.push_back(attributes);
        mesh_.wedge_vertex.push_back(vertex);
        mesh_.normals.push_back(unpack_octahedral(attributes.normal));
        if (atlas_.attributes.uvs)
            mesh_.uvs.push_back(atlas_.uv_low + atlas_.uv_step * glm::vec2(attributes.uv[0], attributes.uv[1]));
        if (atlas_.attributes.colours) mesh_.colours.push_back(attributes.colour);
        if (atlas_.attributes.materials) mesh_.materials.push_back(attributes.material);
    }

    const Atlas& atlas_;
    const LeafBorders borders_;
    Atlas::Tile square_{};  // at hand
    std::unordered_map<uint64_t, uint32_t> vertices_;
    std::vector<uint32_t> wedges_of_, next_wedge_;  // per vertex its first wedge, per wedge the next of its vertex
    std::vector<TexelAttributes> attributes_;       // per wedge
    TriMesh mesh_;
};

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

}  // namespace

TriMesh extract_leaves(const Atlas& atlas) {
    LODE_CHECK(!atlas.leaves.empty());
    return SourceExtraction(atlas).run();
}

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
    std::vector<EdgeBalance> of_charts(atlas.charts());
    parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
        for (auto c = static_cast<uint32_t>(begin); c < end; ++c) {
            EdgeBalance& edges = of_charts[c];
            for_squares(atlas, c, [&](const Atlas::Tile& square, uint32_t leaf) {
                for (uint32_t p = atlas.first_part(leaf); p < atlas.leaves[leaf].parts_end; ++p) {
                    const LeafPart part = decoded_leaf(atlas, p);
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
    if (!all.empty()) return fail(Fault::invariant, "atlas: leaves do not fit together");
    return {};
}

}  // namespace lodestone::vgi
