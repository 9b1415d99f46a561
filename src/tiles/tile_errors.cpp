#include "tiles/tile_errors.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

#include "base/threads.h"
#include "tiles/farthest.h"
#include "tiles/tile_mesh.h"
#include "vgi/asset/pages.h"

namespace lodestone::tiles {

void LatticeBox::add(const std::array<uint16_t, 3>& point) {
    for (size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], point[k]);
        high[k] = std::max(high[k], point[k]);
    }
}
void LatticeBox::add(const LatticeBox& box) {
    for (size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], box.low[k]);
        high[k] = std::max(high[k], box.high[k]);
    }
}

namespace {

using vgi::Atlas;

constexpr double resolution = 0.1;  // steps of the lattice: what is nearer counts as touching
constexpr double falls_by = 1 + 1e-6;

// A grid of samples as a surface: of triangle 2 i and 2 i + 1 of cell i, row by row.
template <class At>
void add_grid(uint32_t n, bool first_rises, At&& at, std::vector<uint32_t>& indices) {
    for (uint32_t y = 0; y < n; ++y) {
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = at(x, y), b = at(x + 1, y), d = at(x, y + 1), e = at(x + 1, y + 1);
            if (vgi::rising_diagonal(x, y) == first_rises) {
                indices.insert(indices.end(), {a, b, e, a, e, d});
            } else {
                indices.insert(indices.end(), {a, b, d, b, e, d});
            }
        }
    }
}

// Measures squares of one chart against their own finest samples; steps of the lattice.
class ChartMeasure {
public:
    ChartMeasure(const Atlas& atlas, const CutRims& cut, uint32_t chart)
        : atlas_(atlas), chart_(chart), cells_(atlas.cells_of(chart)), resolution_(resolution * cut.coarseness()) {}

    // As TileMeasure::error, of one square and some of its sides. level: coarser than the finest.
    double error(const ChartSquare& square, uint32_t level, const std::vector<uint32_t>& sides) {
        if (!finest_ || square != measured_) finest_.emplace(surface(square.x, square.y, square.cells, 1));
        measured_ = square;
        const uint32_t stride = stride_of(atlas_, chart_, level);
        std::vector<SurfacePiece> fine_pieces, coarse_pieces;
        add_pieces(square, stride, fine_pieces, coarse_pieces);
        const TargetSurface coarse = surface(square.x, square.y, square.cells, stride);
        double farthest = farthest_of(std::move(fine_pieces), coarse, 0, resolution_);
        for (const uint32_t side : sides) add_closing_pieces(square, stride, side, coarse_pieces);
        return farthest_of(std::move(coarse_pieces), *finest_, farthest, resolution_);
    }

private:
    glm::dvec3 point(uint32_t x, uint32_t y) const {
        const auto& p = atlas_.positions[atlas_.texel(chart_, x, y)];
        return {p[0], p[1], p[2]};
    }
    TargetSurface surface(uint32_t x0, uint32_t y0, uint32_t cells, uint32_t stride) const {
        const uint32_t n = cells / stride;
        std::vector<glm::vec3> positions;
        std::vector<uint32_t> indices;
        for (uint32_t y = 0; y <= n; ++y) {
            for (uint32_t x = 0; x <= n; ++x) positions.emplace_back(point(x0 + x * stride, y0 + y * stride));
        }
        add_grid(
            n, vgi::rising_diagonal(x0 / stride, y0 / stride), [&](uint32_t x, uint32_t y) { return y * (n + 1) + x; },
            indices);
        return {std::move(positions), std::move(indices)};
    }

    // Where the coarse grid is at the place of a finest sample.
    glm::dvec3 on_coarse(uint32_t x, uint32_t y, uint32_t stride) const {
        const uint32_t cx = std::min(x / stride, cells_ / stride - 1), cy = std::min(y / stride, cells_ / stride - 1);
        const double u = static_cast<double>(x - cx * stride) / stride,
                     v = static_cast<double>(y - cy * stride) / stride;
        const glm::dvec3 a = point(cx * stride, cy * stride), b = point((cx + 1) * stride, cy * stride),
                         d = point(cx * stride, (cy + 1) * stride), e = point((cx + 1) * stride, (cy + 1) * stride);
        if (vgi::rising_diagonal(cx, cy)) return u >= v ? a + (b - a) * u + (e - b) * v : a + (e - d) * u + (d - a) * v;
        return u + v <= 1 ? a + (b - a) * u + (d - a) * v : e + (d - e) * (1 - u) + (b - e) * (1 - v);
    }
    // The coarse triangle, as surface() numbers them, in which a fine triangle lies: by its centre, in thirds of cells.
    static uint32_t coarse_triangle(uint32_t x3, uint32_t y3, uint32_t stride, uint32_t n, bool first_rises) {
        const uint32_t cx = x3 / (3 * stride), cy = y3 / (3 * stride);
        const uint32_t u = x3 - cx * 3 * stride, v = y3 - cy * 3 * stride;
        const bool rises = vgi::rising_diagonal(cx, cy) == first_rises;
        const bool second = rises ? u < v : u + v > 3 * stride;
        return 2 * (cy * n + cx) + (second ? 1 : 0);
    }

    // Every finest triangle, and what stands for it, bounded by how far their corners are from each other.
    void add_pieces(const ChartSquare& s, uint32_t stride, std::vector<SurfacePiece>& fine,
                    std::vector<SurfacePiece>& coarse) const {
        const uint32_t w = s.cells + 1, n = s.cells / stride;
        std::vector<glm::dvec3> is, stands;
        for (uint32_t y = 0; y < w; ++y) {
            for (uint32_t x = 0; x < w; ++x) {
                is.push_back(point(s.x + x, s.y + y));
                stands.push_back(on_coarse(s.x + x, s.y + y, stride));
            }
        }
        std::vector<uint32_t> indices;
        add_grid(
            s.cells, vgi::rising_diagonal(s.x, s.y), [&](uint32_t x, uint32_t y) { return y * w + x; }, indices);
        const bool first_rises = vgi::rising_diagonal(s.x / stride, s.y / stride);
        for (size_t i = 0; i < indices.size(); i += 3) {
            SurfacePiece a, b;
            uint32_t x3 = 0, y3 = 0;
            for (size_t k = 0; k < 3; ++k) {
                const uint32_t v = indices[i + k];
                a.corners[k] = is[v];
                b.corners[k] = stands[v];
                a.bound = std::max(a.bound, glm::distance(is[v], stands[v]));
                x3 += v % w;
                y3 += v / w;
            }
            b.bound = a.bound;
            a.near = coarse_triangle(x3, y3, stride, n, first_rises);
            b.near = static_cast<uint32_t>(i / 3);
            fine.push_back(a);
            coarse.push_back(b);
        }
    }

    // The triangles that close a side lie between polylines of levels: no point is farther from the finest one than
    // the two that it lies between.
    void add_closing_pieces(const ChartSquare& s, uint32_t stride, uint32_t side,
                            std::vector<SurfacePiece>& pieces) const {
        const auto at = [&](uint32_t step) {
            const auto [x, y] = sample_on_side(s, side, step);
            return point(x, y);
        };
        for_closing_triangles(stride, s.cells, [&](uint32_t a, uint32_t m, uint32_t b) {
            SurfacePiece piece{{at(a), at(m), at(b)}};
            for (uint32_t k = a + 1; k < b; ++k) {
                const double t = static_cast<double>(k - a) / (b - a);
                const glm::dvec3 outer = at(a) + (at(b) - at(a)) * t;
                const glm::dvec3 inner =
                    k <= m ? at(a) + (at(m) - at(a)) * (2 * t) : at(m) + (at(b) - at(m)) * (2 * t - 1);
                piece.bound = std::max({piece.bound, glm::distance(outer, at(k)), glm::distance(inner, at(k))});
            }
            if (piece.bound > 0) pieces.push_back(piece);
        });
    }

    const Atlas& atlas_;
    const uint32_t chart_, cells_;
    const double resolution_;
    std::optional<TargetSurface> finest_;
    ChartSquare measured_;  // whose samples these are
};

// What the bake measured of the pages of a square, or of the whole level where pages are finer.
double source_error_of(const Atlas& atlas, const ChartSquare& s, uint32_t level) {
    const vgi::PageTree tree = vgi::tree_of(atlas, vgi::Layer::geometry, s.chart);
    const uint32_t own = atlas.own_level(s.chart, level);
    if (own > tree.base_level() || atlas.bounds.empty())
        return atlas.errors.empty() ? 0 : static_cast<double>(atlas.errors[level]);
    const uint32_t span = tree.cells_per_page() << own;
    const size_t first = size_t{s.chart} * vgi::tree_of(atlas, vgi::Layer::geometry).pages();
    double error = 0;
    for (uint32_t y = s.y / span; y * span < s.y + s.cells; ++y) {
        for (uint32_t x = s.x / span; x * span < s.x + s.cells; ++x)
            error = std::max(error, static_cast<double>(atlas.bounds[first + tree.page(own, x, y)].error));
    }
    return error;
}

LatticeBox box_of(const Atlas& atlas, const ChartSquare& s) {
    LatticeBox box;
    for (uint32_t y = s.y; y <= s.y + s.cells; ++y) {
        for (uint32_t x = s.x; x <= s.x + s.cells; ++x) box.add(atlas.positions[atlas.texel(s.chart, x, y)]);
    }
    return box;
}

// Vertices of the line that a piece was cut along, where a side is closed to it.
void add_line(const Atlas& atlas, const CutRims& cut, const ChartSquare& s, uint32_t side, LatticeBox& box) {
    if (!cut.on(atlas, s, side)) return;
    for (uint32_t step = 0; step < s.cells; ++step) {
        for (const CutRims::Place& place : cut.beyond(atlas, s, side, step)) box.add(place);
    }
}

// A square of a tile, and the sides of it that are closed.
struct Job {
    uint32_t tile = 0, square = 0;
    std::vector<uint32_t> sides;
    TileMeasure measure;
};

std::vector<std::vector<Job>> jobs_by_chart(const Atlas& atlas, const TileTree& tree) {
    std::vector<std::vector<Job>> jobs(atlas.charts());
    for (uint32_t t = 0; t < tree.nodes.size(); ++t) {
        const TileNode& node = tree.nodes[t];
        std::vector<std::vector<uint32_t>> sides(node.squares.size());
        for (const ClosingSide& side : closing_sides(atlas, tree, t)) sides[side.square].push_back(side.side);
        for (uint32_t i = 0; i < node.squares.size(); ++i)
            jobs[node.squares[i].chart].push_back({t, i, std::move(sides[i]), {}});
    }
    return jobs;
}

void measure_chart(const Atlas& atlas, const TileTree& tree, uint32_t chart, std::vector<Job>& jobs) {
    ChartMeasure measure(atlas, tree.cut, chart);
    for (Job& job : jobs) {
        const TileNode& node = tree.nodes[job.tile];
        const ChartSquare& square = node.squares[job.square];
        if (node.children.empty()) {
            job.measure.box = box_of(atlas, square);
            for (const uint32_t side : job.sides) add_line(atlas, tree.cut, square, side, job.measure.box);
        }
        job.measure.source_error = source_error_of(atlas, square, node.level);
        if (atlas.own_level(chart, node.level) > 0)
            job.measure.error = atlas.step * measure.error(square, node.level, job.sides);
    }
}

// Errors that fall from parent to child, boxes that hold those of children.
void gather(const TileTree& tree, std::vector<TileMeasure>& measures) {
    for (size_t t = measures.size(); t-- > 1;) {
        TileMeasure& parent = measures[tree.nodes[t].parent];
        parent.error = std::max(parent.error, measures[t].error * falls_by);
        parent.source_error = std::max(parent.source_error, measures[t].source_error);
        parent.box.add(measures[t].box);
    }
}

// Takes out what lies below tiles without error.
void drop_needless(TileTree& tree, std::vector<TileMeasure>& measures) {
    std::vector<uint32_t> now(tree.nodes.size(), no_tile);
    std::vector<char> needless(tree.nodes.size(), 0);
    TileTree kept;
    kept.meeting = std::move(tree.meeting);
    kept.cut = std::move(tree.cut);
    std::vector<TileMeasure> of_kept;
    for (uint32_t t = 0; t < tree.nodes.size(); ++t) {
        TileNode& node = tree.nodes[t];
        const bool root = node.parent == no_tile;
        needless[t] = !root && (needless[node.parent] || measures[node.parent].error <= 0);
        if (needless[t]) continue;
        now[t] = static_cast<uint32_t>(kept.nodes.size());
        if (!root) kept.nodes[now[node.parent]].children.push_back(now[t]);
        kept.nodes.push_back({node.level, root ? no_tile : now[node.parent], {}, std::move(node.squares)});
        of_kept.push_back(measures[t]);
    }
    tree = std::move(kept);
    measures = std::move(of_kept);
}

}  // namespace

Result<std::vector<TileMeasure>> measure_tiles(const Atlas& atlas, TileTree& tree, const Progress& progress) {
    std::vector<std::vector<Job>> jobs = jobs_by_chart(atlas, tree);
    constexpr size_t batch = 64;
    for (size_t begin = 0; begin < jobs.size(); begin += batch) {
        if (progress.stopped()) return fail(Fault::interrupted, "interrupted");
        progress.at("errors of tiles", static_cast<double>(begin) / static_cast<double>(jobs.size()));
        parallel_for(std::min(batch, jobs.size() - begin), 1, [&](size_t first, size_t end) {
            for (size_t c = begin + first; c < begin + end; ++c)
                measure_chart(atlas, tree, static_cast<uint32_t>(c), jobs[c]);
        });
    }
    std::vector<TileMeasure> measures(tree.nodes.size());
    for (const auto& of_chart : jobs) {
        for (const Job& job : of_chart) {
            TileMeasure& m = measures[job.tile];
            m.error = std::max(m.error, job.measure.error);
            m.source_error = std::max(m.source_error, job.measure.source_error);
            m.box.add(job.measure.box);
        }
    }
    gather(tree, measures);
    drop_needless(tree, measures);
    return measures;
}

}  // namespace lodestone::tiles
