#include "tiles/finest.h"

#include <algorithm>
#include <map>
#include <span>

#include "base/threads.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/leaves/leaves.h"

namespace lodestone::tiles {

namespace {

using vgi::Atlas;
using vgi::GridPoint;
using vgi::LeafBorder;
using vgi::LeafPart;
using vgi::LeafVertex;

constexpr uint32_t none = ~0u;

// The squares of leaves that make up a square.
template <class Visit>
void for_leaf_squares(const Atlas& atlas, const ChartSquare& s, Visit&& visit) {
    const uint32_t cells = leaf_cells(atlas, s.chart);
    for (uint32_t y = s.y / cells; y * cells < s.y + s.cells; ++y) {
        for (uint32_t x = s.x / cells; x * cells < s.x + s.cells; ++x) visit(Atlas::Tile{s.chart, x, y});
    }
}

TileVertex of_leaf(const Atlas& atlas, uint32_t chart, const LeafVertex& v) {
    const vgi::TexelAttributes attributes = attributes_at(atlas, chart, v);
    TileVertex vertex;
    vertex.position = v.position;
    vertex.normal = attributes.normal;
    if (!atlas.uvs.empty()) vertex.uv = attributes.uv;
    if (!atlas.colours.empty()) vertex.colour = attributes.colour;
    return vertex;
}

// Gathers the triangles of squares of one chart.
class Gathering {
public:
    Gathering(const Atlas& atlas, uint32_t chart, FinestTriangles& to) : atlas_(atlas), chart_(chart), to_(to) {}

    void add_samples(const ChartSquare& s) {
        const uint32_t first = static_cast<uint32_t>(to_.vertices.size()), width = s.cells + 1;
        for (uint32_t y = 0; y <= s.cells; ++y) {
            for (uint32_t x = 0; x <= s.cells; ++x) add_sample(s.x + x, s.y + y);
        }
        for (uint32_t y = 0; y < s.cells; ++y) {
            for (uint32_t x = 0; x < s.cells; ++x) {
                const uint32_t a = first + y * width + x, b = a + 1, d = a + width, c = d + 1;
                for (const auto& t : vgi::cell_triangles(vgi::rising_diagonal(s.x + x, s.y + y), a, b, c, d))
                    add_triangle(t[0], t[1], t[2], static_cast<uint16_t>(materials_[t[0]]));
            }
        }
    }

    void add_leaf(const Atlas::Tile& square, const LeafBorder& border) {
        const uint32_t leaf = atlas_.leaf(square.chart, square.x, square.y), cells = leaf_cells(atlas_, chart_);
        const glm::uvec2 corner(square.x * cells, square.y * cells);
        std::map<std::array<int32_t, 2>, uint32_t> samples;
        for (uint32_t p = atlas_.first_part(leaf); p < atlas_.leaves[leaf].parts_end; ++p) {
            const LeafPart part = decoded_leaf(atlas_, p);
            std::vector<uint32_t> numbers(part.vertices.size(), none);
            const auto own = [&](uint32_t v) {
                if (numbers[v] == none) numbers[v] = add_own(part.vertices[v]);
                return numbers[v];
            };
            const auto sample = [&](GridPoint at) {
                const auto [found, fresh] = samples.try_emplace({at.x, at.y}, 0);
                if (fresh)
                    found->second =
                        add_sample(corner.x + static_cast<uint32_t>(at.x), corner.y + static_cast<uint32_t>(at.y));
                return found->second;
            };
            for_drawn_triangles(
                part, border, static_cast<int32_t>(cells), own, sample,
                [&](uint32_t a, uint32_t b, uint32_t c) { add_triangle(a, b, c, material_of(a, b, c)); });
        }
    }

private:
    uint32_t add(const TileVertex& v, const glm::dvec2& at, uint32_t material) {
        to_.vertices.push_back(v);
        to_.at.push_back(at);
        materials_.push_back(material);
        return static_cast<uint32_t>(to_.vertices.size() - 1);
    }
    uint32_t add_sample(uint32_t x, uint32_t y) {
        return add(sample_at(atlas_, chart_, x, y), glm::dvec2(x, y), of_sample | material_at(atlas_, chart_, x, y));
    }
    uint32_t add_own(const LeafVertex& v) {
        const glm::dvec2 at = glm::dvec2(v.place[0], v.place[1]) * (atlas_.cells_of(chart_) / double{vgi::leaf_places});
        return add(of_leaf(atlas_, chart_, v), at, v.attributes.material);
    }
    // That of the leaf, where a triangle has any vertex of it.
    uint16_t material_of(uint32_t a, uint32_t b, uint32_t c) const {
        return static_cast<uint16_t>(std::min({materials_[a], materials_[b], materials_[c]}));
    }
    void add_triangle(uint32_t a, uint32_t b, uint32_t c, uint16_t material) {
        const auto place = [&](uint32_t v) { return to_.vertices[v].position; };
        if (place(a) == place(b) || place(b) == place(c) || place(c) == place(a)) return;
        to_.triangles.push_back({a, b, c});
        to_.materials.push_back(material);
    }

    static constexpr uint32_t of_sample = 1u << 16;
    const Atlas& atlas_;
    const uint32_t chart_;
    FinestTriangles& to_;
    std::vector<uint32_t> materials_;  // per vertex; of samples with of_sample
};

// The line of a leaf along one of its sides, out of the edges that its triangles have there and do not share. Where
// vertices fall on one place it may pass that more than once.
class LeafLine {
public:
    LeafLine(const Atlas& atlas, const Atlas::Tile& square, const LeafBorder& border, uint32_t side)
        : atlas_(atlas), square_(square), border_(border), side_(side), cells_(leaf_cells(atlas, square.chart)) {}

    void add(const LeafPart& part) {
        for (const auto& t : part.triangles) {
            for (uint32_t k = 0; k < 3; ++k) {
                const LeafVertex &a = part.vertices[t[k]], &b = part.vertices[t[(k + 1) % 3]];
                if (a.border == 0 || b.border == 0 || !a.on_side(side_) || !b.on_side(side_)) continue;
                const uint32_t i = number(a), j = number(b);
                if (i == j) continue;
                const int way = i < j ? 1 : -1;
                edges_[{std::min(i, j), std::max(i, j)}] += way;
            }
        }
    }

    // A way over all edges, each once, from where the side begins (Hierholzer).
    std::vector<SideVertex> line() {
        std::vector<std::vector<uint32_t>> leads_to(vertices_.size());
        for (const auto& [ends, times] : edges_) {
            for (int i = 0; i < times; ++i) leads_to[ends[0]].push_back(ends[1]);
            for (int i = 0; i > times; --i) leads_to[ends[1]].push_back(ends[0]);
        }
        std::vector<SideVertex> line;
        std::vector<uint32_t> way;
        if (begin_ != none) way.push_back(begin_);
        while (!way.empty()) {
            std::vector<uint32_t>& next = leads_to[way.back()];
            if (next.empty()) {
                line.push_back(vertices_[way.back()]);
                way.pop_back();
            } else {
                way.push_back(next.back());
                next.pop_back();
            }
        }
        std::ranges::reverse(line);
        return line;
    }

private:
    uint32_t number(const LeafVertex& v) {
        const double at = v.place[side_ % 2] * (atlas_.cells_of(square_.chart) / double{vgi::leaf_places}),
                     along = at - (side_ % 2 == 0 ? square_.x : square_.y) * cells_;
        SideVertex of{of_leaf(atlas_, square_.chart, v), side_ < 2 ? along : cells_ - along};
        const bool begins = v.border == 5 + side_;
        if (v.is_corner()) {
            const auto [x, y] = vgi::on_side(v.border - 5u, 0u, cells_);
            if (border_.corner_sampled[v.border - 5u])
                of.vertex = sample_at(atlas_, square_.chart, square_.x * cells_ + x, square_.y * cells_ + y);
        }
        const auto [found, fresh] = numbers_.try_emplace(of.vertex.position, static_cast<uint32_t>(vertices_.size()));
        if (fresh) vertices_.push_back(of);
        if (begins) begin_ = found->second;
        return found->second;
    }

    const Atlas& atlas_;
    const Atlas::Tile square_;
    const LeafBorder& border_;
    const uint32_t side_, cells_;
    uint32_t begin_ = none;
    std::map<LatticePoint, uint32_t> numbers_;
    std::vector<SideVertex> vertices_;
    std::map<std::array<uint32_t, 2>, int> edges_;  // lower number first: how often more that way
};

// Of one chart: the lines of sides of leaves, one behind the other, and where each ends.
struct ChartLines {
    std::vector<SideVertex> lines;
    std::vector<uint32_t> ends;
};

ChartLines lines_of(const Atlas& atlas, const vgi::LeafBorders& borders, uint32_t chart) {
    ChartLines of;
    for_leaf_squares(atlas, {chart, 0, 0, atlas.cells_of(chart)}, [&](const Atlas::Tile& square) {
        const uint32_t leaf = atlas.leaf(chart, square.x, square.y);
        const LeafBorder border = borders.of(atlas, square);
        std::vector<LeafLine> lines;
        for (uint32_t s = 0; s < 4; ++s) lines.emplace_back(atlas, square, border, s);
        for (uint32_t p = atlas.first_part(leaf); p < atlas.leaves[leaf].parts_end; ++p) {
            const LeafPart part = decoded_leaf(atlas, p);
            for (uint32_t s = 0; s < 4; ++s) {
                if (!border.sampled[s]) lines[s].add(part);
            }
        }
        for (LeafLine& line : lines) {
            const std::vector<SideVertex> vertices = line.line();
            of.lines.insert(of.lines.end(), vertices.begin(), vertices.end());
            of.ends.push_back(static_cast<uint32_t>(of.lines.size()));
        }
    });
    return of;
}

// The texel of the attributes at a sample.
size_t attribute_texel_at(const Atlas& atlas, uint32_t chart, uint32_t x, uint32_t y) {
    const uint32_t ratio = atlas.attribute_ratio_of(chart);
    return atlas.attribute_texel(chart, x * ratio, y * ratio);
}

}  // namespace

uint16_t material_at(const Atlas& atlas, uint32_t chart, uint32_t x, uint32_t y) {
    return atlas.materials.empty() ? uint16_t{0} : atlas.materials[attribute_texel_at(atlas, chart, x, y)];
}

TileVertex sample_at(const Atlas& atlas, uint32_t chart, uint32_t x, uint32_t y) {
    const size_t texel = attribute_texel_at(atlas, chart, x, y);
    const auto& p = atlas.positions[atlas.texel(chart, x, y)];
    const uint32_t shift = place_shift(atlas);
    TileVertex v;
    v.position = {uint32_t{p[0]} << shift, uint32_t{p[1]} << shift, uint32_t{p[2]} << shift};
    v.normal = atlas.normals[texel];
    if (!atlas.uvs.empty()) v.uv = atlas.uvs[texel];
    if (!atlas.colours.empty()) v.colour = atlas.colours[texel];
    return v;
}

std::vector<SideVertex> samples_of_side(const Atlas& atlas, const ChartSquare& square, uint32_t side, uint32_t stride) {
    std::vector<SideVertex> line;
    for (uint32_t step = 0; step <= square.cells; step += stride) {
        const auto [x, y] = sample_on_side(square, side, step);
        line.push_back({sample_at(atlas, square.chart, x, y), static_cast<double>(step)});
    }
    return line;
}

bool has_leaves(const Atlas& atlas, const ChartSquare& square) {
    if (atlas.leaves.empty()) return false;
    bool any = false;
    for_leaf_squares(atlas, square, [&](const Atlas::Tile& leaf_square) {
        any = any || atlas.has_leaf(atlas.leaf(square.chart, leaf_square.x, leaf_square.y));
    });
    return any;
}

uint64_t finest_triangles_in(const Atlas& atlas, const ChartSquare& square) {
    if (!has_leaves(atlas, square)) return 2 * uint64_t{square.cells} * square.cells;
    const uint32_t cells = leaf_cells(atlas, square.chart);
    uint64_t triangles = 0;
    for_leaf_squares(atlas, square, [&](const Atlas::Tile& leaf_square) {
        const uint32_t leaf = atlas.leaf(square.chart, leaf_square.x, leaf_square.y);
        if (!atlas.has_leaf(leaf)) triangles += 2 * uint64_t{cells} * cells;
        for (uint32_t p = atlas.first_part(leaf); p < atlas.leaves[leaf].parts_end; ++p)
            triangles += vgi::triangles_in_leaf(atlas.leaf_parts[p]);
    });
    return triangles;
}

FinestSurface::FinestSurface(const Atlas& atlas) {
    if (atlas.leaves.empty()) return;
    borders_ = vgi::LeafBorders(atlas);
    std::vector<ChartLines> charts(atlas.charts());
    parallel_for(charts.size(), 1, [&](size_t begin, size_t end) {
        for (size_t c = begin; c < end; ++c) charts[c] = lines_of(atlas, borders_, static_cast<uint32_t>(c));
    });
    first_.push_back(0);
    for (ChartLines& of : charts) {
        const auto before = static_cast<uint32_t>(lines_.size());
        for (const uint32_t line_end : of.ends) first_.push_back(before + line_end);
        lines_.insert(lines_.end(), of.lines.begin(), of.lines.end());
        of = {};
    }
}

FinestTriangles FinestSurface::triangles(const Atlas& atlas, const ChartSquare& square) const {
    FinestTriangles triangles;
    Gathering gathering(atlas, square.chart, triangles);
    if (!has_leaves(atlas, square)) {
        gathering.add_samples(square);
        return triangles;
    }
    const uint32_t cells = leaf_cells(atlas, square.chart);
    for_leaf_squares(atlas, square, [&](const Atlas::Tile& leaf_square) {
        if (atlas.has_leaf(atlas.leaf(square.chart, leaf_square.x, leaf_square.y))) {
            gathering.add_leaf(leaf_square, borders_.of(atlas, leaf_square));
        } else {
            gathering.add_samples({square.chart, leaf_square.x * cells, leaf_square.y * cells, cells});
        }
    });
    return triangles;
}

std::vector<SideVertex> FinestSurface::side(const Atlas& atlas, const ChartSquare& square, uint32_t side) const {
    if (!has_leaves(atlas, square)) return samples_of_side(atlas, square, side, 1);
    std::vector<SideVertex> line;
    const uint32_t cells = leaf_cells(atlas, square.chart), last = square.cells / cells - 1;
    for (uint32_t i = 0; i <= last; ++i) {
        const auto [x, y] = vgi::on_side(side, i, last);
        add_side(atlas, {square.chart, square.x / cells + x, square.y / cells + y}, side, i * cells, line);
    }
    return line;
}

void FinestSurface::add_side(const Atlas& atlas, const Atlas::Tile& leaf_square, uint32_t side, uint32_t before,
                             std::vector<SideVertex>& line) const {
    const uint32_t number = 4 * atlas.leaf(leaf_square.chart, leaf_square.x, leaf_square.y) + side;
    const auto add = [&](const SideVertex& v) {
        if (line.empty() || line.back().vertex.position != v.vertex.position)
            line.push_back({v.vertex, std::max(before + v.along, line.empty() ? 0 : line.back().along)});
    };
    const auto own = std::span(lines_).subspan(first_[number], first_[number + 1] - first_[number]);
    for (const SideVertex& v : own) add(v);
    if (!own.empty()) return;
    const uint32_t cells = leaf_cells(atlas, leaf_square.chart);
    const ChartSquare square{leaf_square.chart, leaf_square.x * cells, leaf_square.y * cells, cells};
    for (const SideVertex& v : samples_of_side(atlas, square, side, 1)) add(v);
}

}  // namespace lodestone::tiles
