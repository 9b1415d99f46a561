#include "tiles/tile_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/vec2.hpp>
#include <unordered_map>

#include "base/random.h"

namespace lodestone::tiles {

namespace {

using vgi::Atlas;

struct VertexHash {
    size_t operator()(const TileVertex& v) const {
        const uint64_t place = v.position[0] | uint64_t{v.position[1]} << 21 | uint64_t{v.position[2]} << 42;
        const uint64_t look = v.uv[0] | uint64_t{v.uv[1]} << 16 | uint64_t{std::bit_cast<uint16_t>(v.normal)} << 32;
        return mix64(place ^ mix64(look ^ mix64(std::bit_cast<uint32_t>(v.colour))));
    }
};

// From a line of samples to a finer line: each of its vertices is joined to the nearest sample, of two the first, and
// between two samples is the triangle of the last vertex that the first of them has. The line between the samples runs
// the same way, and so do their ends, which may be apart: then the strips of the sides before and behind join there.
void add_strip(const std::vector<SideVertex>& samples, uint32_t stride, const std::vector<SideVertex>& line,
               std::vector<ClosingTriangle>& triangles) {
    size_t at = 0;
    for (size_t i = 0; i < line.size(); ++i) {
        const auto nearest = static_cast<size_t>(std::ceil(line[i].along / stride - 0.5));
        const size_t last = i + 1 == line.size() ? samples.size() - 1 : std::min(nearest, samples.size() - 1);
        if (i > 0) triangles.push_back({{samples[at], line[i - 1], line[i]}});
        for (; at < last; ++at) triangles.push_back({{samples[at], line[i], samples[at + 1]}});
    }
}

class TileMeshBuilder {
public:
    TileMeshBuilder(const Atlas& atlas, const TileTree& tree, uint32_t tile)
        : atlas_(atlas),
          node_(tree.nodes[tile]),
          finest_(tree.finest),
          cut_(tree.cut),
          closing_(closing_sides(atlas, tree, tile)) {}

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
    uint32_t add_vertex(const TileVertex& v) {
        mesh_.vertices.push_back(v);
        return static_cast<uint32_t>(mesh_.vertices.size() - 1);
    }
    // Equal ones are one: of borders, and of leaves.
    uint32_t shared_vertex(const TileVertex& v) {
        const auto [at, fresh] = on_border_.try_emplace(v, static_cast<uint32_t>(mesh_.vertices.size()));
        if (fresh) mesh_.vertices.push_back(v);
        return at->second;
    }

    void add_triangle(uint32_t a, uint32_t b, uint32_t c, uint16_t material) {
        const auto place = [&](uint32_t v) { return mesh_.vertices[v].position; };
        if (place(a) == place(b) || place(b) == place(c) || place(c) == place(a)) return;
        mesh_.triangles.push_back({a, b, c});
        if (!atlas_.materials.empty()) mesh_.materials.push_back(material);
    }

    void add_finest(const ChartSquare& s) {
        const FinestTriangles finest = finest_.triangles(atlas_, s);
        std::vector<uint32_t> number;
        for (const TileVertex& v : finest.vertices) number.push_back(shared_vertex(v));
        for (size_t t = 0; t < finest.triangles.size(); ++t) {
            const auto& [a, b, c] = finest.triangles[t];
            add_triangle(number[a], number[b], number[c], finest.materials[t]);
        }
    }
    void add_square(const ChartSquare& s) {
        const uint32_t stride = stride_of(atlas_, s.chart, node_.level), n = s.cells / stride;
        if (stride == 1) return add_finest(s);
        std::vector<uint32_t> grid;
        grid.reserve(size_t{n + 1} * (n + 1));
        for (uint32_t y = 0; y <= n; ++y) {
            for (uint32_t x = 0; x <= n; ++x) {
                const TileVertex v = sample_at(atlas_, s.chart, s.x + x * stride, s.y + y * stride);
                const bool border = x == 0 || y == 0 || x == n || y == n;
                grid.push_back(border ? shared_vertex(v) : add_vertex(v));
            }
        }
        const auto at = [&](const glm::uvec2& p) { return grid[size_t{p.y} * (n + 1) + p.x]; };
        for (uint32_t y = 0; y < n; ++y) {
            for (uint32_t x = 0; x < n; ++x) {
                // Diagonals go by the cells of the whole chart.
                const bool rising = vgi::rising_diagonal(s.x / stride + x, s.y / stride + y);
                const glm::uvec2 a(x, y), b(x + 1, y), c(x + 1, y + 1), d(x, y + 1);
                for (const auto& t : vgi::cell_triangles(rising, a, b, c, d))
                    add_triangle(at(t[0]), at(t[1]), at(t[2]),
                                 material_at(atlas_, s.chart, s.x + t[0].x * stride, s.y + t[0].y * stride));
            }
        }
    }

    void close(const ChartSquare& s, uint32_t side) {
        for (const ClosingTriangle& t :
             closing_triangles(atlas_, finest_, s, side, stride_of(atlas_, s.chart, node_.level))) {
            const auto [x, y] = sample_on_side(s, side, static_cast<uint32_t>(t.corners[0].along));
            const auto vertex = [&](size_t k) { return shared_vertex(t.corners[k].vertex); };
            add_triangle(vertex(0), vertex(1), vertex(2), material_at(atlas_, s.chart, x, y));
        }
    }

    // From every edge of the finest line of a side to the line that the piece was cut along: a fan of each of its ends,
    // which meet in the middle of the vertices. These look as the end of their fan does.
    void go_on_to_the_line(const ChartSquare& s, uint32_t side) {
        const std::vector<SideVertex> finest = finest_.side(atlas_, s, side);
        const auto beyond = cut_.beyond(atlas_, s, side, finest);
        for (size_t edge = 0; edge < beyond.size(); ++edge) {
            const auto line = beyond[edge];
            if (line.empty()) continue;
            const TileVertex &begin = finest[edge].vertex, &end = finest[edge + 1].vertex;
            const auto on_line = [&](size_t i, const TileVertex& look) {
                TileVertex v = look;
                v.position = line[i];
                return shared_vertex(v);
            };
            const auto [x, y] = sample_on_side(s, side, static_cast<uint32_t>(finest[edge].along));
            const size_t middle = line.size() / 2;
            const uint16_t material = material_at(atlas_, s.chart, x, y);
            const uint32_t a = shared_vertex(begin), b = shared_vertex(end);
            for (size_t i = 0; i < middle; ++i) add_triangle(a, on_line(i, begin), on_line(i + 1, begin), material);
            add_triangle(a, on_line(middle, begin), b, material);
            for (size_t i = middle; i + 1 < line.size(); ++i)
                add_triangle(b, on_line(i, end), on_line(i + 1, end), material);
        }
    }

    const Atlas& atlas_;
    const TileNode& node_;
    const FinestSurface& finest_;
    const CutRims& cut_;
    const std::vector<ClosingSide> closing_;
    std::unordered_map<TileVertex, uint32_t, VertexHash> on_border_;
    TileMesh mesh_;
};

}  // namespace

std::vector<ClosingTriangle> closing_triangles(const Atlas& atlas, const FinestSurface& finest,
                                               const ChartSquare& square, uint32_t side, uint32_t stride) {
    std::vector<ClosingTriangle> triangles;
    for (; stride > 1; stride /= 2) {
        const std::vector<SideVertex> line =
            stride == 2 ? finest.side(atlas, square, side) : samples_of_side(atlas, square, side, stride / 2);
        add_strip(samples_of_side(atlas, square, side, stride), stride, line, triangles);
    }
    return triangles;
}

TileMesh make_tile_mesh(const Atlas& atlas, const TileTree& tree, uint32_t tile) {
    return TileMeshBuilder(atlas, tree, tile).run();
}

}  // namespace lodestone::tiles
