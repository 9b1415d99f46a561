#include "vgi/bake/images/parameterise.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "base/check.h"
#include "vgi/bake/charts/harmonic.h"
#include "vgi/bake/charts/merged_pieces.h"

namespace lodestone::vgi {

namespace {

constexpr double densest = 9.21;  // logarithm of the ratio of densities to 1, either way
constexpr int smoothing_passes = 8;
constexpr double little_stretch = 1.8;    // of a chart: no other way is tried
constexpr double most_importance = 0.69;  // logarithm, either way

// Each triangle's becomes the mean of its own and its neighbours'. Where densities jump, so does the shear of what is
// laid out, and samples either side of the jump may fold.
void smooth(const ChartMesh& patch, std::vector<double>& logarithms) {
    std::vector<double> before;
    for (int pass = 0; pass < smoothing_passes; ++pass) {
        before = logarithms;
        for (uint32_t t = 0; t < before.size(); ++t) {
            double sum = before[t];
            int count = 1;
            for (uint32_t k = 0; k < 3; ++k) {
                const uint32_t g = patch.twin[t * 3 + k];
                if (g == none) continue;
                sum += before[g / 3];
                ++count;
            }
            logarithms[t] = sum / count;
        }
    }
}

// Vertices of the sides onto the sides of the square, by arc length from the arc's own beginning, so that the two
// charts that share it agree bit for bit up to the direction.
void place_boundary(Chart& chart, const Surface& surface, std::span<const Side> sides, const std::vector<Arc>& arcs) {
    const auto number = chart.patch.numbers();
    constexpr glm::dvec2 begin[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, along[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    chart.patch.flat.assign(chart.patch.positions.size(), {0.5, 0.5});
    for (size_t s = 0; s < 4; ++s) {
        const Arc& arc = arcs[sides[s].arc];
        const std::vector<double> places = places_along(arc, surface.positions);
        for (size_t i = 0; i < arc.vertices.size(); ++i) {
            const double share = sides[s].reversed ? 1 - places[i] : places[i];
            const uint32_t v = number.at(arc.vertices[i]);
            const bool last = sides[s].reversed ? i == 0 : i + 1 == arc.vertices.size();
            if (!last) chart.patch.flat[v] = begin[s] + along[s] * share;
        }
    }
}

// Splits inner edges with both ends on one side of the square. Once sides are placed.
void split_chords_of_sides(ChartMesh& patch) {
    const std::vector<bool> rim = patch.on_boundary();
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        const uint32_t a = patch.from(h), b = patch.to(h);
        if (patch.twin[h] == none || a >= rim.size() || b >= rim.size() || !rim[a] || !rim[b]) continue;
        const glm::dvec2 &p = patch.flat[a], &q = patch.flat[b];
        const bool together = (p.x == q.x && (p.x == 0 || p.x == 1)) || (p.y == q.y && (p.y == 0 || p.y == 1));
        if (together) patch.split_edge(h, 0.5, 0.5);
    }
}

// As l2_stretch; a triangle that is to be sampled more densely counts as larger. Empty: all evenly.
double weighted_stretch(const ChartMesh& patch, std::span<const double> importance) {
    double sum = 0, area = 0;
    for (uint32_t t = 0; t < patch.triangles.size(); ++t) {
        const double a = patch.area(t), weight = importance.empty() ? 1 : std::exp(2 * importance[t]);
        sum += a * weight * squared_stretch(patch, t);
        area += a;
    }
    return area > 0 ? std::sqrt(sum) / area : 1;
}

// Per triangle, the logarithm of how many times denser than evenly it is to be sampled, from the angles to its
// neighbours over the distances to them.
std::vector<double> importance_of(const ChartMesh& patch, double power) {
    std::vector<double> logarithms(patch.triangles.size(), 0.0);
    if (power == 0) return logarithms;
    std::vector<glm::dvec3> normal;
    std::vector<double> areas, curvature(patch.triangles.size(), 0.0);
    double whole = 0, mean = 0;
    for (const SurfaceTriangle& t : patch.triangles) {
        const glm::dvec3 twice =
            area_vector(patch.positions[t.vertices[0]], patch.positions[t.vertices[1]], patch.positions[t.vertices[2]]);
        const double length = glm::length(twice);
        normal.push_back(length > 0 ? twice / length : glm::dvec3(0));
        areas.push_back(length / 2);
        whole += length / 2;
    }
    for (uint32_t t = 0; t < curvature.size(); ++t) {
        // Bending of an edge is spread over both its triangles.
        for (uint32_t h = t * 3; h < t * 3 + 3; ++h) {
            if (patch.twin[h] == none) continue;
            const double angle = glm::length(normal[t] - normal[patch.twin[h] / 3]);
            curvature[t] += angle * glm::length(patch.positions[patch.to(h)] - patch.positions[patch.from(h)]);
        }
        mean += curvature[t];
        curvature[t] /= std::max(areas[t], 1e-12 * whole);
    }
    mean /= std::max(whole, 1e-300);
    if (!(mean > 0)) return logarithms;
    for (uint32_t t = 0; t < curvature.size(); ++t)
        logarithms[t] =
            std::clamp(power * std::log(std::max(curvature[t] / mean, 1e-6)), -most_importance, most_importance);
    smooth(patch, logarithms);
    return logarithms;
}

// Lays the inside out without folds, with weights that know the surface or, where those fold, with equal ones.
Result<void> lay_out(HarmonicSolver& solver, Chart& chart, size_t triangles) {
    ++chart.solves;
    if (solver.solve({}) && chart.patch.flipped() == 0) return {};
    chart.uniform = true;
    ++chart.solves;
    if (solver.solve({}, true) && chart.patch.flipped() == 0) return {};
    return fail(Fault::invariant,
                "a quad of " + std::to_string(triangles) + " triangles folds however its edges are weighed");
}

// Changes weights, round after round, while sampling becomes more even by it.
void make_even(HarmonicSolver& solver, Chart& chart, const ParameteriseOptions& options) {
    ChartMesh& patch = chart.patch;
    std::vector<double> logarithms(patch.triangles.size(), 0.0), tried, density(patch.triangles.size());
    double exponent = 1;
    const std::vector<double> importance = importance_of(patch, options.curvature_importance);
    double weighed = weighted_stretch(patch, importance);
    std::vector<glm::dvec2> best = patch.flat;
    while (chart.solves < options.most_solves) {
        // Where the surface is stretched its springs give way.
        tried = logarithms;
        const double mean = std::sqrt(chart.area) * weighed;
        for (uint32_t t = 0; t < tried.size(); ++t) {
            const double sigma = std::sqrt(squared_stretch(patch, t)) / mean;
            tried[t] =
                std::clamp(tried[t] - exponent * (std::log(std::max(sigma, 1e-6)) + importance[t]), -densest, densest);
        }
        smooth(patch, tried);
        for (uint32_t t = 0; t < tried.size(); ++t) density[t] = std::exp(tried[t]);
        ++chart.solves;
        const bool solved = solver.solve(density) && patch.flipped() == 0;
        const double stretch = solved ? weighted_stretch(patch, importance) : 0;
        if (!solved || !(stretch < weighed)) {
            patch.flat = best;
            exponent /= 2;
            if (exponent < 0.2) break;
            continue;
        }
        const double gain = 1 - stretch / weighed;
        weighed = stretch;
        logarithms.swap(tried);
        best = patch.flat;
        if (gain < options.least_gain) break;
    }
    patch.flat = std::move(best);
}

}  // namespace

double squared_stretch(const ChartMesh& patch, uint32_t triangle) {
    const auto& v = patch.triangles[triangle].vertices;
    const glm::dvec2 &a = patch.flat[v[0]], &b = patch.flat[v[1]], &c = patch.flat[v[2]];
    const glm::dvec3 &p = patch.positions[v[0]], &q = patch.positions[v[1]], &r = patch.positions[v[2]];
    const double twice = patch.signed_flat_area(triangle);
    const glm::dvec3 by_s = (p * (b.y - c.y) + q * (c.y - a.y) + r * (a.y - b.y)) / twice,
                     by_t = (p * (c.x - b.x) + q * (a.x - c.x) + r * (b.x - a.x)) / twice;
    return (glm::dot(by_s, by_s) + glm::dot(by_t, by_t)) / 2;
}

double l2_stretch(const ChartMesh& patch) { return weighted_stretch(patch, {}); }

namespace {

Result<Chart> laid_out(ChartMesh taken, const Surface& surface, std::span<const Side> sides,
                       const std::vector<Arc>& arcs, const ParameteriseOptions& options) {
    Chart chart;
    chart.patch = std::move(taken);
    if (!options.sliding_sides) split_chords(chart.patch);
    ChartMesh& patch = chart.patch;
    place_boundary(chart, surface, sides, arcs);
    if (options.sliding_sides) split_chords_of_sides(patch);
    for (uint32_t t = 0; t < patch.triangles.size(); ++t) chart.area += patch.area(t);
    HarmonicSolver solver(patch,
                          options.sliding_sides ? HarmonicSolver::Border::sliding : HarmonicSolver::Border::pinned);
    if (auto done = lay_out(solver, chart, patch.triangles.size()); !done) return tl::unexpected(done.error());
    chart.tutte_stretch = l2_stretch(patch);
    if (!chart.uniform) make_even(solver, chart, options);
    chart.stretch = l2_stretch(patch);
    return chart;
}

}  // namespace

Result<Chart> parameterise(const Surface& surface, std::span<const uint32_t> triangles, std::span<const Side> sides,
                           const std::vector<Arc>& arcs, const ParameteriseOptions& options) {
    LODE_CHECK(sides.size() == 4, sides.size());
    ChartMesh merged = take_chart_mesh(surface, triangles);
    const bool less = merge_pieces(merged, surface.uncut) > 0;
    auto chart = laid_out(std::move(merged), surface, sides, arcs, options);
    if (!less || (chart && chart->stretch <= little_stretch && !chart->uniform)) return chart;
    // Pieces bend where whole triangles cannot.
    auto in_pieces = laid_out(take_chart_mesh(surface, triangles), surface, sides, arcs, options);
    return in_pieces && (!chart || in_pieces->stretch < chart->stretch) ? std::move(in_pieces) : std::move(chart);
}

}  // namespace lodestone::vgi
