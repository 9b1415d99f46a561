#include "tiles/tile_mesh.h"

#include <bit>
#include <unordered_map>

#include "base/random.h"

namespace lodestone::tiles {

namespace {

using vgi::Atlas;

struct VertexHash {
    size_t operator()(const TileVertex& v) const {
        const uint64_t place = v.position[0] | uint64_t{v.position[1]} << 16 | uint64_t{v.position[2]} << 32;
        const uint64_t look = v.uv[0] | uint64_t{v.uv[1]} << 16 | uint64_t{std::bit_cast<uint16_t>(v.normal)} << 32;
        return mix64(place ^ mix64(look ^ mix64(std::bit_cast<uint32_t>(v.colour))));
    }
};

class TileMeshBuilder {
public:
    TileMeshBuilder(const Atlas& atlas, const TileTree& tree, uint32_t tile)
        : atlas_(atlas), node_(tree.nodes[tile]), cut_(tree.cut), closing_(closing_sides(atlas, tree, tile)) {}

    TileMesh run() {
        for (const ChartSquare& square : node_.squares) add_square(square);
        mesh_.surface_triangles = mesh_.triangles.size();
        for (const ClosingSide& side : closing_) {
            close(node_.squares[side.square], side.side);
            if (!cut_.empty()) go_on_to_the_line(node_.squares[side.square], side.side);
        }
        return std::move(mesh_);
    }

private:
    size_t attribute_texel(uint32_t chart, uint32_t x, uint32_t y) const {
        const uint32_t ratio = atlas_.attribute_cells / atlas_.cells;
        return atlas_.attribute_texel(chart, x * ratio, y * ratio);
    }
    TileVertex vertex(uint32_t chart, uint32_t x, uint32_t y) const {
        const size_t texel = attribute_texel(chart, x, y);
        TileVertex v;
        v.position = atlas_.positions[atlas_.texel(chart, x, y)];
        v.normal = atlas_.normals[texel];
        if (!atlas_.uvs.empty()) v.uv = atlas_.uvs[texel];
        if (!atlas_.colours.empty()) v.colour = atlas_.colours[texel];
        return v;
    }
    uint32_t add_vertex(const TileVertex& v) {
        mesh_.vertices.push_back(v);
        return static_cast<uint32_t>(mesh_.vertices.size() - 1);
    }
    // Equal ones of borders are one.
    uint32_t border_vertex(const TileVertex& v) {
        const auto [at, fresh] = on_border_.try_emplace(v, static_cast<uint32_t>(mesh_.vertices.size()));
        if (fresh) mesh_.vertices.push_back(v);
        return at->second;
    }

    // material_of: the texel of the attributes that tells the material.
    void add_triangle(uint32_t a, uint32_t b, uint32_t c, size_t material_of) {
        const auto place = [&](uint32_t v) { return mesh_.vertices[v].position; };
        if (place(a) == place(b) || place(b) == place(c) || place(c) == place(a)) return;
        mesh_.triangles.push_back({a, b, c});
        if (!atlas_.materials.empty()) mesh_.materials.push_back(atlas_.materials[material_of]);
    }

    void add_square(const ChartSquare& s) {
        const uint32_t stride = stride_of(atlas_, s.chart, node_.level), n = s.cells / stride;
        std::vector<uint32_t> grid;
        grid.reserve(size_t{n + 1} * (n + 1));
        for (uint32_t y = 0; y <= n; ++y) {
            for (uint32_t x = 0; x <= n; ++x) {
                const TileVertex v = vertex(s.chart, s.x + x * stride, s.y + y * stride);
                const bool border = x == 0 || y == 0 || x == n || y == n;
                grid.push_back(border ? border_vertex(v) : add_vertex(v));
            }
        }
        const auto at = [&](uint32_t x, uint32_t y) { return grid[size_t{y} * (n + 1) + x]; };
        const auto texel = [&](uint32_t x, uint32_t y) {
            return attribute_texel(s.chart, s.x + x * stride, s.y + y * stride);
        };
        for (uint32_t y = 0; y < n; ++y) {
            for (uint32_t x = 0; x < n; ++x) {
                const uint32_t a = at(x, y), b = at(x + 1, y), d = at(x, y + 1), e = at(x + 1, y + 1);
                // Diagonals go by the cells of the whole chart.
                if (vgi::rising_diagonal(s.x / stride + x, s.y / stride + y)) {
                    add_triangle(a, b, e, texel(x, y));
                    add_triangle(a, e, d, texel(x, y));
                } else {
                    add_triangle(a, b, d, texel(x, y));
                    add_triangle(b, e, d, texel(x + 1, y));
                }
            }
        }
    }

    void close(const ChartSquare& s, uint32_t side) {
        const auto sample = [&](uint32_t step) {
            const auto [x, y] = sample_on_side(s, side, step);
            return border_vertex(vertex(s.chart, x, y));
        };
        for_closing_triangles(stride_of(atlas_, s.chart, node_.level), s.cells,
                              [&](uint32_t a, uint32_t m, uint32_t b) {
                                  const auto [x, y] = sample_on_side(s, side, a);
                                  add_triangle(sample(a), sample(m), sample(b), attribute_texel(s.chart, x, y));
                              });
    }

    // From every finest edge of a side to the line that the piece was cut along: a fan of each sample, which meet in
    // the middle of the vertices. These look as the sample of their fan does.
    void go_on_to_the_line(const ChartSquare& s, uint32_t side) {
        for (uint32_t step = 0; step < s.cells; ++step) {
            const auto line = cut_.beyond(atlas_, s, side, step);
            if (line.empty()) continue;
            const auto [x, y] = sample_on_side(s, side, step);
            const auto [next_x, next_y] = sample_on_side(s, side, step + 1);
            const TileVertex begin = vertex(s.chart, x, y), end = vertex(s.chart, next_x, next_y);
            const auto on_line = [&](size_t i, const TileVertex& look) {
                TileVertex v = look;
                v.position = line[i];
                return border_vertex(v);
            };
            const size_t material_of = attribute_texel(s.chart, x, y), middle = line.size() / 2;
            const uint32_t a = border_vertex(begin), b = border_vertex(end);
            for (size_t i = 0; i < middle; ++i) add_triangle(a, on_line(i, begin), on_line(i + 1, begin), material_of);
            add_triangle(a, on_line(middle, begin), b, material_of);
            for (size_t i = middle; i + 1 < line.size(); ++i)
                add_triangle(b, on_line(i, end), on_line(i + 1, end), material_of);
        }
    }

    const Atlas& atlas_;
    const TileNode& node_;
    const CutRims& cut_;
    const std::vector<ClosingSide> closing_;
    std::unordered_map<TileVertex, uint32_t, VertexHash> on_border_;
    TileMesh mesh_;
};

}  // namespace

TileMesh make_tile_mesh(const Atlas& atlas, const TileTree& tree, uint32_t tile) {
    return TileMeshBuilder(atlas, tree, tile).run();
}

}  // namespace lodestone::tiles
