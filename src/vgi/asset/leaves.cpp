#include "vgi/asset/leaves.h"

#include <algorithm>
#include <bit>
#include <map>
#include <string>
#include <unordered_map>

#include "base/check.h"
#include "base/files/entropy_coder.h"
#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "vgi/asset/leaf_triangles.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

namespace {

// A part as streams of small numbers: which vertices triangles have, and what vertices differ by from what the triangle
// that first has them lets expect. Vertices are numbered as triangles first use them.
struct Streams {
    std::vector<uint8_t> links;              // per corner: 0 for the next new vertex, else how many before that
    std::vector<uint8_t> low, middle, high;  // of positions
    std::vector<uint8_t> place_low, place_high, border, step;
    std::vector<uint8_t> normal, uv_low, uv_high, colour, material_low, material_high;

    // Calls visit(stream) for those that there are, in order. The number of steps follows from the borders.
    template <class Visit>
    void for_each(const AtlasAttributes& has, Visit&& visit) {
        for (auto* stream : {&links, &low, &middle, &high, &place_low, &place_high, &border, &step, &normal})
            visit(*stream);
        if (has.uvs) {
            visit(uv_low);
            visit(uv_high);
        }
        if (has.colours) visit(colour);
        if (has.materials) {
            visit(material_low);
            visit(material_high);
        }
    }
};

uint32_t zigzag(int32_t off) { return (static_cast<uint32_t>(off) << 1) ^ (0u - (static_cast<uint32_t>(off) >> 31)); }
int32_t unzigzag(uint32_t folded) { return static_cast<int32_t>((folded >> 1) ^ (0u - (folded & 1u))); }
uint8_t byte_of(uint32_t number, uint32_t shift = 0) { return static_cast<uint8_t>(number >> shift & 255u); }

// What a vertex is expected to be like: the mean of two known ones.
struct Expected {
    const LeafVertex *a, *b;
    int32_t position(size_t k) const { return static_cast<int32_t>((a->position[k] + b->position[k]) / 2); }
    int32_t place(size_t k) const { return (int32_t{a->place[k]} + b->place[k]) / 2; }
};

// Of every vertex, those that its first triangle has besides it and that come before; or the one before.
std::vector<std::array<uint8_t, 2>> known_before(const LeafPart& part) {
    std::vector<std::array<uint8_t, 2>> known;
    for (const auto& t : part.triangles) {
        for (uint32_t k = 0; k < 3; ++k) {
            if (t[k] != known.size()) continue;
            std::array<uint8_t, 2> of{};
            uint32_t count = 0;
            for (const uint8_t other : {t[(k + 1) % 3], t[(k + 2) % 3]}) {
                if (other < t[k]) of[count++] = other;
            }
            if (count == 0) of[0] = t[k] == 0 ? uint8_t{0} : static_cast<uint8_t>(t[k] - 1);
            if (count < 2) of[1] = of[0];
            known.push_back(of);
        }
    }
    return known;
}

void put_attributes(const TexelAttributes& is, const TexelAttributes& like, Streams& to) {
    for (size_t k = 0; k < 2; ++k) {
        to.normal.push_back(byte_of(zigzag(static_cast<int8_t>(is.normal[k] - like.normal[k]))));
        const uint32_t uv = zigzag(static_cast<int16_t>(is.uv[k] - like.uv[k]));
        to.uv_low.push_back(byte_of(uv));
        to.uv_high.push_back(byte_of(uv, 8));
    }
    for (int k = 0; k < 4; ++k)
        to.colour.push_back(byte_of(zigzag(static_cast<int8_t>(is.colour[k] - like.colour[k]))));
    const uint32_t material = zigzag(static_cast<int16_t>(is.material - like.material));
    to.material_low.push_back(byte_of(material));
    to.material_high.push_back(byte_of(material, 8));
}

// v: of the vertices, whose attributes the streams have where the atlas has them.
TexelAttributes taken_attributes(const Streams& from, size_t v, const TexelAttributes& like,
                                 const AtlasAttributes& has) {
    TexelAttributes is;
    const auto wide = [&](const std::vector<uint8_t>& low, const std::vector<uint8_t>& high, size_t i) {
        return unzigzag(uint32_t{low[i]} | uint32_t{high[i]} << 8);
    };
    for (size_t k = 0; k < 2; ++k) {
        is.normal[k] = static_cast<int8_t>(like.normal[k] + unzigzag(from.normal[2 * v + k]));
        if (has.uvs) is.uv[k] = static_cast<uint16_t>(like.uv[k] + wide(from.uv_low, from.uv_high, 2 * v + k));
    }
    for (int k = 0; k < 4 && has.colours; ++k)
        is.colour[k] = static_cast<uint8_t>(like.colour[k] + unzigzag(from.colour[4 * v + static_cast<size_t>(k)]));
    if (has.materials)
        is.material = static_cast<uint16_t>(like.material + wide(from.material_low, from.material_high, v));
    return is;
}

void put_vertex(const LeafVertex& v, const Expected& expected, Streams& to) {
    for (size_t k = 0; k < 3; ++k) {
        const uint32_t off = zigzag(static_cast<int32_t>(v.position[k]) - expected.position(k));
        to.low.push_back(byte_of(off));
        to.middle.push_back(byte_of(off, 8));
        to.high.push_back(byte_of(off, 16));
    }
    for (size_t k = 0; k < 2; ++k) {
        const uint32_t off = zigzag(int32_t{v.place[k]} - expected.place(k));
        to.place_low.push_back(byte_of(off));
        to.place_high.push_back(byte_of(off, 8));
    }
    to.border.push_back(v.border);
    if (v.border > 0 && !v.is_corner()) to.step.push_back(v.step);
    put_attributes(v.attributes, expected.a->attributes, to);
}

tl::unexpected<Error> broken() { return fail(Fault::format, "cannot be unpacked"); }

// Triangles out of their links; false where a link leads nowhere.
bool take_triangles(const Streams& from, size_t vertices, LeafPart& part) {
    uint32_t next = 0;
    for (size_t i = 0; i < from.links.size(); ++i) {
        const uint32_t link = from.links[i];
        if (link > next || (link == 0 && next == vertices)) return false;
        part.triangles[i / 3][i % 3] = static_cast<uint8_t>(link == 0 ? next++ : next - link);
    }
    return next == vertices;
}

}  // namespace

std::vector<std::byte> encode_leaf(const LeafPart& part, const AtlasAttributes& attributes) {
    LODE_CHECK(!part.vertices.empty() && part.vertices.size() <= most_leaf_vertices, part.vertices.size());
    LODE_CHECK(part.triangles.size() <= most_leaf_triangles, part.triangles.size());
    Streams streams;
    uint32_t next = 0;
    for (const auto& t : part.triangles) {
        for (const uint8_t v : t) {
            LODE_CHECK(v <= next, v, next);
            streams.links.push_back(v == next ? uint8_t{0} : static_cast<uint8_t>(next - v));
            next += v == next;
        }
    }
    LODE_CHECK(next == part.vertices.size(), next);
    const LeafVertex nothing;
    const auto known = known_before(part);
    for (size_t v = 0; v < part.vertices.size(); ++v) {
        const LeafVertex *a = &nothing, *b = &nothing;
        if (v > 0) {
            a = &part.vertices[known[v][0]];
            b = &part.vertices[known[v][1]];
        }
        put_vertex(part.vertices[v], {a, b}, streams);
    }
    const auto triangles = static_cast<uint32_t>(part.triangles.size());
    std::vector<std::byte> packed{static_cast<std::byte>(part.vertices.size() - 1),
                                  static_cast<std::byte>(triangles & 255), static_cast<std::byte>(triangles >> 8)};
    streams.for_each(attributes, [&](const std::vector<uint8_t>& stream) { encode_numbers(stream, packed); });
    return packed;
}

namespace {

// Makes room for the streams of a part, whose number of steps is not known yet.
void make_room(Streams& streams, size_t vertices, size_t triangles) {
    streams.links.resize(3 * triangles);
    for (auto* stream : {&streams.low, &streams.middle, &streams.high}) stream->resize(3 * vertices);
    for (auto* stream : {&streams.place_low, &streams.place_high, &streams.normal, &streams.uv_low, &streams.uv_high})
        stream->resize(2 * vertices);
    for (auto* stream : {&streams.border, &streams.material_low, &streams.material_high}) stream->resize(vertices);
    streams.colour.resize(4 * vertices);
}

// False where the bytes are not those of such streams, and no more.
bool unpack(std::span<const std::byte> bytes, const AtlasAttributes& attributes, Streams& streams) {
    bool good = true;
    streams.for_each(attributes, [&](std::vector<uint8_t>& stream) {
        if (&stream == &streams.step) {
            good = good && std::ranges::all_of(streams.border, [](uint8_t border) { return border <= 8; });
            stream.resize(static_cast<size_t>(
                std::ranges::count_if(streams.border, [](uint8_t border) { return border >= 1 && border <= 4; })));
        }
        if (!good) return;
        const auto rest = decode_numbers(bytes, stream);
        good = rest.has_value();
        if (good) bytes = *rest;
    });
    return good && bytes.empty();
}

// Vertex i, all but its attributes and its step; false where it is out of range.
bool take_vertex(const Streams& from, size_t i, const Expected& expected, LeafVertex& v) {
    for (size_t k = 0; k < 3; ++k) {
        const size_t at = 3 * i + k;
        const uint32_t off = from.low[at] | uint32_t{from.middle[at]} << 8 | uint32_t{from.high[at]} << 16;
        v.position[k] = static_cast<uint32_t>(expected.position(k) + unzigzag(off));
        if (v.position[k] >> leaf_bits != 0) return false;
    }
    for (size_t k = 0; k < 2; ++k) {
        const uint32_t off = from.place_low[2 * i + k] | uint32_t{from.place_high[2 * i + k]} << 8;
        const int32_t place = expected.place(k) + unzigzag(off);
        if (place < 0 || place > static_cast<int32_t>(leaf_places)) return false;
        v.place[k] = static_cast<uint16_t>(place);
    }
    v.border = from.border[i];
    return true;
}

}  // namespace

Result<LeafPart> decode_leaf(std::span<const std::byte> bytes, const AtlasAttributes& attributes) {
    if (bytes.size() < leaf_header_bytes) return broken();
    const size_t vertices = static_cast<size_t>(bytes[0]) + 1, triangles = triangles_in_leaf(bytes);
    if (triangles == 0 || triangles > most_leaf_triangles || vertices > most_leaf_vertices) return broken();
    Streams streams;
    make_room(streams, vertices, triangles);
    if (!unpack(bytes.subspan(leaf_header_bytes), attributes, streams)) return broken();
    LeafPart part;
    part.vertices.resize(vertices);
    part.triangles.resize(triangles);
    if (!take_triangles(streams, vertices, part)) return broken();
    const LeafVertex nothing;
    const auto known = known_before(part);
    size_t step = 0;
    for (size_t i = 0; i < vertices; ++i) {
        LeafVertex& v = part.vertices[i];
        Expected expected{&nothing, &nothing};
        if (i > 0) expected = {&part.vertices[known[i][0]], &part.vertices[known[i][1]]};
        if (!take_vertex(streams, i, expected, v)) return broken();
        if (v.border > 0 && !v.is_corner()) v.step = streams.step[step++];
        v.attributes = taken_attributes(streams, i, expected.a->attributes, attributes);
    }
    return part;
}

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
                [&](uint32_t v) { return wedge(part.vertices[v].position, part.vertices[v].attributes); },
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
