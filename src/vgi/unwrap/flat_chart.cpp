#include "vgi/unwrap/flat_chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "vgi/bake/charts/harmonic.h"
#include "vgi/bake/charts/templates.h"
#include "vgi/bake/images/parameterise.h"

namespace lodestone::vgi {

namespace {

constexpr double longest_aspect = 1e4;  // of a chart's rectangle: needles are stretched rather than drawn as lines

constexpr double good_stretch = 1.6;  // of a chart: no other way is tried

void measure(FlatChart& chart) {
    const ChartMesh& patch = chart.patch;
    chart.area = chart.along_x = chart.along_y = 0;
    double filled = 0;
    for (uint32_t t = 0; t < patch.triangles.size(); ++t) {
        const auto& v = patch.triangles[t].vertices;
        const glm::dvec2 &a = patch.flat[v[0]], &b = patch.flat[v[1]], &c = patch.flat[v[2]];
        const glm::dvec3 &p = patch.positions[v[0]], &q = patch.positions[v[1]], &r = patch.positions[v[2]];
        const double twice = patch.signed_flat_area(t), area = patch.area(t);
        chart.area += area;
        filled += twice / 2;
        if (!(twice > 0)) continue;
        const glm::dvec3 by_x = (p * (b.y - c.y) + q * (c.y - a.y) + r * (a.y - b.y)) / twice,
                         by_y = (p * (c.x - b.x) + q * (a.x - c.x) + r * (b.x - a.x)) / twice;
        chart.along_x += area * glm::dot(by_x, by_x);
        chart.along_y += area * glm::dot(by_y, by_y);
    }
    chart.filled = std::clamp(filled, 1e-9, 1.0);
}

// The border of three vertices as it is, its longest edge along x.
void place_triangle(ChartMesh& patch, const std::vector<uint32_t>& border) {
    std::array<uint32_t, 3> v = {border[0], border[1], border[2]};
    const auto length = [&](size_t k) { return glm::distance(patch.positions[v[k]], patch.positions[v[(k + 1) % 3]]); };
    size_t longest = 0;
    for (size_t k = 1; k < 3; ++k) {
        if (length(k) > length(longest)) longest = k;
    }
    std::rotate(v.begin(), v.begin() + static_cast<ptrdiff_t>(longest), v.end());
    const glm::dvec3 base = patch.positions[v[1]] - patch.positions[v[0]],
                     other = patch.positions[v[2]] - patch.positions[v[0]];
    const double squared = glm::dot(base, base);
    const double apex = squared > 0 ? std::clamp(glm::dot(base, other) / squared, 0.0, 1.0) : 0.5;
    patch.flat.assign(patch.positions.size(), {0.5, 0.3});
    patch.flat[v[0]] = {0, 0};
    patch.flat[v[1]] = {1, 0};
    patch.flat[v[2]] = {apex, 1};
}

Result<FlatChart> lay_triangle(ChartMesh patch, const std::vector<uint32_t>& border) {
    FlatChart chart{std::move(patch)};
    place_triangle(chart.patch, border);
    HarmonicSolver solver(chart.patch);
    const bool laid =
        (solver.solve({}) && chart.patch.flipped() == 0) || (solver.solve({}, true) && chart.patch.flipped() == 0);
    if (!laid) return fail(Fault::invariant, "a chart with three vertices on its border folds however it is laid out");
    return chart;
}

// The border in four arcs between the corners.
std::vector<Arc> arcs_between(const Surface& surface, const std::vector<uint32_t>& loop,
                              const std::array<uint32_t, 4>& corners) {
    std::vector<Arc> arcs(4);
    size_t at = static_cast<size_t>(std::ranges::find(loop, corners[0]) - loop.begin());
    for (size_t k = 0; k < 4; ++k) {
        Arc& arc = arcs[k];
        arc.left = 0;
        arc.vertices.push_back(loop[at]);
        do {
            at = (at + 1) % loop.size();
            arc.length += glm::distance(surface.positions[arc.vertices.back()], surface.positions[loop[at]]);
            arc.vertices.push_back(loop[at]);
        } while (loop[at] != corners[(k + 1) % 4]);
    }
    return arcs;
}

}  // namespace

double FlatChart::stretch(double width, double height) const {
    if (!(area > 0)) return 1;
    const double squared = (along_x / (width * width) + along_y / (height * height)) / 2;
    return std::sqrt(squared * filled * width * height) / area;
}

double FlatChart::best_aspect() const {
    if (!(along_x > 0) || !(along_y > 0)) return 1;
    return std::clamp(std::sqrt(along_x / along_y), 1 / longest_aspect, longest_aspect);
}

Result<FlatChart> lay_flat(const Surface& surface, std::span<const uint32_t> triangles) {
    ChartMesh patch = take_chart_mesh(surface, triangles);
    const std::vector<uint32_t> border = patch.boundary();
    FlatChart chart;
    if (border.size() == 3) {
        auto laid = lay_triangle(std::move(patch), border);
        if (!laid) return laid;
        chart = std::move(*laid);
    } else {
        const auto quad = disk_template(surface, triangles);
        if (!quad) return fail(Fault::invariant, "a cluster is not a disk");
        std::vector<uint32_t> loop;
        for (const uint32_t v : border) loop.push_back(patch.origin[v]);
        const std::vector<Arc> arcs = arcs_between(surface, loop, quad->corners);
        const std::array<Side, 4> sides = {Side{0, false}, Side{1, false}, Side{2, false}, Side{3, false}};
        ParameteriseOptions options;
        options.curvature_importance = 0;  // texels are to be spread evenly
        // Sides that slide are mostly better, and where the surface is bad sometimes much worse.
        for (const bool sliding : {true, false}) {
            options.sliding_sides = sliding;
            auto laid = parameterise(surface, triangles, sides, arcs, options);
            if (!laid && !sliding && chart.patch.triangles.empty()) return tl::unexpected(laid.error());
            if (!laid) continue;
            FlatChart other{std::move(laid->patch)};
            measure(other);
            if (chart.patch.triangles.empty() || other.best_stretch() < chart.best_stretch()) chart = std::move(other);
            if (chart.best_stretch() < good_stretch) break;
        }
        return chart;
    }
    measure(chart);
    return chart;
}

void lay_evenly(FlatChart& chart) {
    const std::vector<glm::dvec2> before = chart.patch.flat;
    HarmonicSolver solver(chart.patch);  // where the border is
    if (!solver.solve({}, true) || chart.patch.flipped() > 0) chart.patch.flat = before;
    measure(chart);
}

JoinedSurface joined_surface(const TriMesh& mesh) {
    ChartMesh whole;
    JoinedSurface joined;
    for (const glm::vec3& p : mesh.positions) whole.positions.emplace_back(p);
    whole.origin.assign(whole.positions.size(), none);
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t)
        whole.triangles.push_back({{mesh.vertex_of(t, 0), mesh.vertex_of(t, 1), mesh.vertex_of(t, 2)}, t});
    std::vector<uint32_t> twin = twins_of(whole.triangles, whole.positions.size());
    std::erase_if(whole.triangles, [&](const SurfaceTriangle& t) {
        const bool lone =
            twin[t.source * 3] == none && twin[t.source * 3 + 1] == none && twin[t.source * 3 + 2] == none;
        if (lone) joined.lone.push_back(t.source);
        return lone;
    });
    if (!joined.lone.empty()) twin = twins_of(whole.triangles, whole.positions.size());
    whole.twin = std::move(twin);
    joined.chords = split_chords(whole);
    joined.surface.positions = std::move(whole.positions);
    joined.surface.triangles = std::move(whole.triangles);
    joined.surface.places = std::move(whole.places);
    return joined;
}

uint32_t smooth_borders(std::span<const uint32_t> twins, std::vector<uint32_t>& label) {
    // Whether the triangle of half-edge h, which ends in the middle of the two border edges, is the only one there that
    // is not of the other cluster.
    const auto alone_at_end = [&](uint32_t h, uint32_t other) {
        const uint32_t begin = next_corner(h);
        for (uint32_t g = twins[begin]; g != none && g / 3 != h / 3; g = twins[next_corner(g)]) {
            if (label[g / 3] != other) return false;
            if (next_corner(g) == twins[h]) return true;
            if (twins[next_corner(g)] == none) return false;
        }
        return false;
    };
    // The cluster that the triangle is to go to, or none.
    const auto taker = [&](uint32_t t) {
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t h = t * 3 + k, next = t * 3 + (k + 1) % 3, last = t * 3 + (k + 2) % 3;
            if (twins[h] == none || twins[next] == none || twins[last] == none) continue;
            const uint32_t other = label[twins[h] / 3];
            if (other == label[t] || label[twins[next] / 3] != other || label[twins[last] / 3] != label[t]) continue;
            if (alone_at_end(h, other)) return other;
        }
        return none;
    };

    uint32_t given = 0;
    std::vector<uint32_t> waiting;
    for (uint32_t first = 0; first < label.size(); ++first) {
        waiting.push_back(first);
        while (!waiting.empty()) {
            const uint32_t t = waiting.back();
            waiting.pop_back();
            const uint32_t other = taker(t);
            if (other == none) continue;
            label[t] = other;
            ++given;
            for (uint32_t k = 0; k < 3; ++k) waiting.push_back(twins[t * 3 + k] / 3);
        }
    }
    return given;
}

}  // namespace lodestone::vgi
