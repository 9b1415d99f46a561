#include "tiles/errors/square_error.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tiles/errors/polygon.h"
#include "tiles/tile_mesh.h"

namespace lodestone::tiles {

namespace {

using vgi::Atlas;

// The samples of a square, some finest ones apart, as a surface.
class Grid {
public:
    Grid(const Atlas& atlas, const ChartSquare& square, uint32_t stride)
        : square_(square), stride_(stride), n_(square.cells / stride) {
        for (uint32_t y = 0; y <= n_; ++y) {
            for (uint32_t x = 0; x <= n_; ++x) {
                const auto& p =
                    atlas.positions[atlas.texel(square.chart, square.x + x * stride, square.y + y * stride)];
                points_.emplace_back(p[0], p[1], p[2]);
            }
        }
    }
    uint32_t n() const { return n_; }
    double stride() const { return stride_; }
    // From a place in the chart, in finest cells, to cells of the grid.
    glm::dvec2 cells_at(const glm::dvec2& at) const { return (at - glm::dvec2(square_.x, square_.y)) / stride(); }
    // Diagonals go by the cells of the whole chart.
    bool rises(uint32_t x, uint32_t y) const {
        return vgi::rising_diagonal(square_.x / stride_ + x, square_.y / stride_ + y);
    }
    // The plane of a triangle at a place in cells of the grid.
    glm::dvec3 on(uint32_t x, uint32_t y, bool second, const glm::dvec2& place) const {
        const uint32_t i = y * (n_ + 1) + x;
        const double u = place.x - x, v = place.y - y;
        const glm::dvec3 &a = points_[i], &b = points_[i + 1], &d = points_[i + n_ + 1], &e = points_[i + n_ + 2];
        if (rises(x, y)) return second ? a + (e - d) * u + (d - a) * v : a + (b - a) * u + (e - b) * v;
        return second ? e + (d - e) * (1 - u) + (b - e) * (1 - v) : a + (b - a) * u + (d - a) * v;
    }
    // With what closes it. Those of cell i, row by row, are triangles 2 i and 2 i + 1.
    TargetSurface surface(const Atlas& atlas, const std::vector<ClosingTriangle>& closing) const {
        std::vector<glm::vec3> positions(points_.begin(), points_.end());
        std::vector<uint32_t> indices;
        for (uint32_t y = 0; y < n_; ++y) {
            for (uint32_t x = 0; x < n_; ++x) {
                const uint32_t a = y * (n_ + 1) + x, b = a + 1, d = a + n_ + 1, c = d + 1;
                for (const auto& t : vgi::cell_triangles(rises(x, y), a, b, c, d))
                    indices.insert(indices.end(), t.begin(), t.end());
            }
        }
        for (const ClosingTriangle& t : closing) {
            for (const SideVertex& corner : t.corners) {
                indices.push_back(static_cast<uint32_t>(positions.size()));
                positions.emplace_back(in_steps(atlas, corner.vertex.position));
            }
        }
        return {std::move(positions), std::move(indices)};
    }

private:
    const ChartSquare square_;
    const uint32_t stride_, n_;
    std::vector<glm::dvec3> points_;
};

// A part of a finest triangle, convex.
struct Corner {
    glm::dvec2 at;  // in cells of the grid
    glm::dvec3 is;  // on the finest surface
};
using Polygon = std::vector<Corner>;

// What is on either side of a line where way * at is `offset`: below, then above it.
std::array<Polygon, 2> divided_at(const Polygon& polygon, const glm::dvec2& way, double offset) {
    return divided(
        polygon, [&](const Corner& corner) { return glm::dot(way, corner.at) - offset; },
        [](const Corner& a, const Corner& b, double share) {
            return Corner{a.at + (b.at - a.at) * share, a.is + (b.is - a.is) * share};
        });
}

// Pieces of both surfaces that stand for each other.
class Pieces {
public:
    Pieces(const Grid& grid, size_t fine_triangles) : grid_(grid) {
        fine.reserve(fine_triangles);
        coarse.reserve(fine_triangles);
    }
    std::vector<SurfacePiece> fine, coarse;

    void add(const Polygon& triangle, uint32_t number) {
        number_ = number;
        by_columns(triangle);
    }

private:
    uint32_t cell(double at) const {
        return static_cast<uint32_t>(std::clamp(std::floor(at), 0.0, static_cast<double>(grid_.n() - 1)));
    }
    // The cells along an axis that a polygon reaches.
    std::array<uint32_t, 2> reach(const Polygon& polygon, int axis) const {
        double low = polygon[0].at[axis], high = low;
        for (const Corner& corner : polygon) {
            low = std::min(low, corner.at[axis]);
            high = std::max(high, corner.at[axis]);
        }
        const uint32_t first = cell(low);
        return {first, std::max(first, cell(std::ceil(high) - 1))};
    }
    // Calls visit(part, cell) for what of a polygon lies in each row or column of cells.
    template <class Visit>
    void along(const Polygon& polygon, int axis, Visit&& visit) const {
        const auto [first, last] = reach(polygon, axis);
        if (first == last) return visit(polygon, first);
        Polygon rest = polygon;
        for (uint32_t k = first; k < last; ++k) {
            auto [here, behind] = divided_at(rest, axis == 0 ? glm::dvec2(1, 0) : glm::dvec2(0, 1), k + 1.0);
            if (here.size() >= 3) visit(here, k);
            rest = std::move(behind);
        }
        if (rest.size() >= 3) visit(rest, last);
    }
    void by_columns(const Polygon& triangle) {
        along(triangle, 0, [&](const Polygon& column, uint32_t x) {
            along(column, 1, [&](const Polygon& part, uint32_t y) { by_diagonal(part, x, y); });
        });
    }
    void by_diagonal(const Polygon& part, uint32_t x, uint32_t y) {
        // What is below lies beside corner (1, 0), or around (0, 0).
        const glm::dvec2 way = grid_.rises(x, y) ? glm::dvec2(-1, 1) : glm::dvec2(1, 1);
        const double offset = glm::dot(way, glm::dvec2(x, y)) + (grid_.rises(x, y) ? 0 : 1);
        bool below = false, above = false;
        for (const Corner& corner : part) {
            below |= glm::dot(way, corner.at) < offset;
            above |= glm::dot(way, corner.at) > offset;
        }
        if (!(below && above)) return add_piece(part, x, y, above);
        const auto parts = divided_at(part, way, offset);
        add_piece(parts[0], x, y, false);
        add_piece(parts[1], x, y, true);
    }
    void add_piece(const Polygon& part, uint32_t x, uint32_t y, bool second) {
        if (part.size() < 3) return;
        std::vector<glm::dvec3> stands;
        for (const Corner& corner : part) stands.push_back(grid_.on(x, y, second, corner.at));
        for (size_t k = 1; k + 1 < part.size(); ++k) {
            SurfacePiece a{{part[0].is, part[k].is, part[k + 1].is}}, b{{stands[0], stands[k], stands[k + 1]}};
            for (size_t i = 0; i < 3; ++i) a.bound = std::max(a.bound, glm::distance(a.corners[i], b.corners[i]));
            b.bound = a.bound;
            a.near = 2 * (y * grid_.n() + x) + (second ? 1 : 0);
            b.near = number_;
            fine.push_back(a);
            coarse.push_back(b);
        }
    }

    const Grid& grid_;
    uint32_t number_ = 0;  // of the finest triangle at hand
};

// What closes a side, cut where the finest line has vertices: on each piece that line is linear, too.
void add_closing_pieces(const Atlas& atlas, const std::vector<SideVertex>& line, const ClosingTriangle& t,
                        std::vector<SurfacePiece>& pieces) {
    Polygon rest;
    double low = t.corners[0].along, high = low;
    for (const SideVertex& v : t.corners) {
        rest.push_back({{v.along, 0}, in_steps(atlas, v.vertex.position)});
        low = std::min(low, v.along);
        high = std::max(high, v.along);
    }
    const auto behind = std::ranges::upper_bound(line, low, {}, &SideVertex::along);
    const auto last = static_cast<ptrdiff_t>(line.size()) - 2;
    for (ptrdiff_t k = std::clamp(behind - line.begin() - 1, ptrdiff_t{0}, last); rest.size() >= 3; ++k) {
        const auto edge = line.begin() + k;
        const double begin = edge[0].along, length = edge[1].along - begin;
        const glm::dvec3 from = in_steps(atlas, edge[0].vertex.position),
                         way = in_steps(atlas, edge[1].vertex.position) - from;
        Polygon here = rest;
        if (k < last && edge[1].along < high) {
            auto parts = divided_at(rest, {1, 0}, edge[1].along);
            here = std::move(parts[0]);
            rest = std::move(parts[1]);
        } else {
            rest.clear();
        }
        const auto off = [&](const Corner& corner) {
            const double share = length > 0 ? std::clamp((corner.at.x - begin) / length, 0.0, 1.0) : 0;
            return glm::distance(corner.is, from + way * share);
        };
        for (size_t i = 1; i + 1 < here.size(); ++i) {
            SurfacePiece piece{{here[0].is, here[i].is, here[i + 1].is}};
            piece.bound = std::max({off(here[0]), off(here[i]), off(here[i + 1])});
            if (piece.bound > 0) pieces.push_back(piece);
        }
    }
}

TargetSurface surface_of(const Atlas& atlas, const FinestTriangles& finest) {
    std::vector<glm::vec3> positions;
    std::vector<uint32_t> indices;
    for (const TileVertex& v : finest.vertices) positions.emplace_back(in_steps(atlas, v.position));
    for (const auto& t : finest.triangles) indices.insert(indices.end(), t.begin(), t.end());
    // All of it may be one point.
    if (indices.empty()) indices.assign(3, 0);
    return {std::move(positions), std::move(indices)};
}

}  // namespace

double SquareErrors::error(const ChartSquare& square, uint32_t stride, const std::vector<uint32_t>& sides) {
    if (!at_hand_ || square != at_hand_->square) {
        FinestTriangles triangles = finest_.triangles(atlas_, square);
        TargetSurface surface = surface_of(atlas_, triangles);
        at_hand_.emplace(Finest{square, std::move(triangles), std::move(surface)});
    }
    const FinestTriangles& finest = at_hand_->triangles;
    const Grid grid(atlas_, square, stride);
    Pieces pieces(grid, finest.triangles.size());
    for (uint32_t t = 0; t < finest.triangles.size(); ++t) {
        Polygon triangle;
        for (const uint32_t v : finest.triangles[t])
            triangle.push_back({grid.cells_at(finest.at[v]), in_steps(atlas_, finest.vertices[v].position)});
        pieces.add(triangle, t);
    }
    std::vector<ClosingTriangle> closing;
    for (const uint32_t side : sides) {
        std::vector<SideVertex> line = finest_.side(atlas_, square, side);
        line.push_back(line.back());  // it may be one point
        for (const ClosingTriangle& t : closing_triangles(atlas_, finest_, square, side, stride)) {
            add_closing_pieces(atlas_, line, t, pieces.coarse);
            closing.push_back(t);
        }
    }
    const double farthest = farthest_of(std::move(pieces.fine), grid.surface(atlas_, closing), 0, resolution_);
    return farthest_of(std::move(pieces.coarse), at_hand_->surface, farthest, resolution_);
}

}  // namespace lodestone::tiles
