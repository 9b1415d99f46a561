#include "tiles/tile_errors.h"

#include <algorithm>
#include <cmath>

#include "base/threads.h"
#include "tiles/errors/square_error.h"
#include "vgi/asset/pages.h"

namespace lodestone::tiles {

void LatticeBox::add(const LatticePoint& point) {
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

// Steps of the lattice: what is nearer counts as touching. With leaves, half a step of their own.
double resolution_of(const Atlas& atlas, const CutRims& cut) {
    const uint32_t shift = place_shift(atlas);
    return cut.coarseness() * (shift == 0 ? 0.1 : 0.5 / static_cast<double>(1u << shift));
}
constexpr double falls_by = 1 + 1e-6;

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

LatticeBox box_of(const Atlas& atlas, const FinestSurface& finest, const ChartSquare& s) {
    LatticeBox box;
    for (uint32_t y = s.y; y <= s.y + s.cells; ++y) {
        for (uint32_t x = s.x; x <= s.x + s.cells; ++x) box.add(sample_at(atlas, s.chart, x, y).position);
    }
    if (!has_leaves(atlas, s)) return box;
    for (const TileVertex& v : finest.triangles(atlas, s).vertices) box.add(v.position);
    return box;
}

// Vertices of the line that a piece was cut along, where a side is closed to it.
void add_line(const Atlas& atlas, const TileTree& tree, const ChartSquare& s, uint32_t side, LatticeBox& box) {
    if (tree.cut.empty()) return;
    for (const auto& beyond : tree.cut.beyond(atlas, s, side, tree.finest.side(atlas, s, side))) {
        for (const LatticePoint& point : beyond) box.add(point);
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
    SquareErrors errors(atlas, tree.finest, resolution_of(atlas, tree.cut));
    for (Job& job : jobs) {
        const TileNode& node = tree.nodes[job.tile];
        const ChartSquare& square = node.squares[job.square];
        if (node.children.empty()) {
            job.measure.box = box_of(atlas, tree.finest, square);
            for (const uint32_t side : job.sides) add_line(atlas, tree, square, side, job.measure.box);
        }
        job.measure.source_error = source_error_of(atlas, square, node.level);
        const uint32_t stride = stride_of(atlas, chart, node.level);
        if (stride > 1) job.measure.error = atlas.step * errors.error(square, stride, job.sides);
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
    kept.finest = std::move(tree.finest);
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

LatticeBox finest_box(const Atlas& atlas) {
    const FinestSurface finest(atlas);
    std::vector<LatticeBox> charts(atlas.charts());
    parallel_for(charts.size(), 1, [&](size_t begin, size_t end) {
        for (auto c = static_cast<uint32_t>(begin); c < end; ++c)
            charts[c] = box_of(atlas, finest, {c, 0, 0, atlas.cells_of(c)});
    });
    LatticeBox box;
    for (const LatticeBox& of_chart : charts) box.add(of_chart);
    return box;
}

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
