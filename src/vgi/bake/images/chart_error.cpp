#include "vgi/bake/images/chart_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <optional>

#include "base/random.h"
#include "base/threads.h"
#include "mesh/distance/closest_point.h"
#include "mesh/distance/distance.h"

namespace lodestone::vgi {

namespace {

// The corners of a cell of a level: (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1).
struct Cell {
    glm::dvec3 a, b, d, e;
    bool rising;
};
Cell cell_of(const Atlas& atlas, uint32_t chart, uint32_t level, uint32_t x, uint32_t y) {
    const uint32_t s = 1u << level;
    return {atlas.point(atlas.texel(chart, x * s, y * s)), atlas.point(atlas.texel(chart, (x + 1) * s, y * s)),
            atlas.point(atlas.texel(chart, x * s, (y + 1) * s)),
            atlas.point(atlas.texel(chart, (x + 1) * s, (y + 1) * s)), rising_diagonal(x, y)};
}

double squared(const glm::dvec3& v) { return glm::dot(v, v); }

// Squared distance from a point to the cell, or `most` where that is less.
double squared_to(const Cell& c, const glm::dvec3& point, double most) {
    // Seldom is what the box around the cell says not enough.
    const glm::dvec3 low = glm::min(glm::min(c.a, c.b), glm::min(c.d, c.e)),
                     high = glm::max(glm::max(c.a, c.b), glm::max(c.d, c.e));
    if (squared(glm::max(glm::max(low - point, point - high), 0.0)) >= most) return most;
    const auto to = [&](const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r) {
        return squared(closest_on_triangle(point, p, q, r) - point);
    };
    const double first = c.rising ? to(c.a, c.b, c.e) : to(c.a, c.b, c.d),
                 second = c.rising ? to(c.a, c.e, c.d) : to(c.b, c.e, c.d);
    return std::min({most, first, second});
}

}  // namespace

double squared_distance_near(const Atlas& atlas, uint32_t chart, const glm::dvec2& place, int reach,
                             const glm::dvec3& point, double most) {
    // Between samples of the chart's own there is nothing else.
    const uint32_t level = atlas.unsampled_levels[chart];
    const auto last = static_cast<int>(atlas.cells_of(chart) >> level) - 1;
    const int cx = std::clamp(static_cast<int>(place.x * (last + 1)), 0, last),
              cy = std::clamp(static_cast<int>(place.y * (last + 1)), 0, last);
    const auto look = [&](int x, int y) {
        most =
            squared_to(cell_of(atlas, chart, level, static_cast<uint32_t>(x), static_cast<uint32_t>(y)), point, most);
    };
    look(cx, cy);  // mostly the nearest
    for (int y = std::max(0, cy - reach); y <= std::min(last, cy + reach); ++y) {
        for (int x = std::max(0, cx - reach); x <= std::min(last, cx + reach); ++x) {
            if (x != cx || y != cy) look(x, y);
        }
    }
    return most;
}

namespace {

// How far a place is from a side, and how far along it, both in shares of the side.
void to_side(const glm::dvec2& place, uint32_t side, double* away, double* along) {
    const double u = place.x, v = place.y;
    *away = side == 0 ? v : side == 1 ? 1 - u : side == 2 ? 1 - v : u;
    *along = side == 0 ? u : side == 1 ? v : side == 2 ? 1 - u : 1 - v;
}

// The same, looking across borders that are near, and across the next ones from there; or `most`.
double squared_distance(const Atlas& atlas, uint32_t chart, const glm::dvec2& place, const glm::dvec3& point,
                        int borders = 2, double most = 1e300) {
    constexpr double near_cells = 4;
    double least = squared_distance_near(atlas, chart, place, 2, point, most);
    for (uint32_t side = 0; side < 4 && borders > 0; ++side) {
        const GluedSide& other = atlas.sides[size_t{chart} * 4 + side];
        double away = 0, along = 0;
        to_side(place, side, &away, &along);
        const uint32_t cells = atlas.cells_of(chart) >> atlas.unsampled_levels[chart];
        if (other.chart == ~0u || away * cells > near_cells) continue;
        const auto [u, v] = on_side(other.side, 1 - along, 1.0);
        least = squared_distance(atlas, other.chart, {u, v}, point, borders - 1, least);
    }
    return least;
}

}  // namespace

glm::dvec3 image_point(const Atlas& atlas, uint32_t chart, uint32_t level, const glm::dvec2& place) {
    level = std::max<uint32_t>(atlas.own_level(chart, level), atlas.unsampled_levels[chart]);
    const uint32_t n = atlas.cells_of(chart) >> level;
    const double px = std::clamp(place.x, 0.0, 1.0) * n, py = std::clamp(place.y, 0.0, 1.0) * n;
    const uint32_t x = std::min(n - 1, static_cast<uint32_t>(px)), y = std::min(n - 1, static_cast<uint32_t>(py));
    const double fx = px - x, fy = py - y;
    const Cell c = cell_of(atlas, chart, level, x, y);
    if (c.rising) {
        if (fx >= fy) return c.a + (c.b - c.a) * fx + (c.e - c.b) * fy;
        return c.a + (c.d - c.a) * fy + (c.e - c.d) * fx;
    }
    if (fx + fy <= 1) return c.a + (c.b - c.a) * fx + (c.d - c.a) * fy;
    return c.e + (c.d - c.e) * (1 - fx) + (c.b - c.e) * (1 - fy);
}

double mean_squared_distance(const Atlas& atlas, const std::vector<SourceSample>& samples) {
    double sum = 0, area = 0;
    for (const SourceSample& s : samples) {
        if (s.area == 0) continue;
        sum += s.area * squared_distance(atlas, s.chart, s.place, s.position, 0);
        area += s.area;
    }
    return area > 0 ? sum / area : 0;
}

std::vector<SourceSample> sample_source(uint32_t quad, const Chart& chart, uint32_t samples) {
    const ChartMesh& patch = chart.patch;
    std::vector<SourceSample> result;
    Random random(mix64(quad + 1));
    if (patch.positions.size() <= samples) {
        for (size_t v = 0; v < patch.positions.size(); ++v)
            result.push_back({patch.positions[v], patch.flat[v], quad, 0});
    }
    // A sample whenever the area so far passes another share.
    const double share = chart.area / samples;
    double area = 0, next = share * random.unit();
    for (uint32_t t = 0; t < patch.triangles.size(); ++t) {
        const auto& v = patch.triangles[t].vertices;
        area += patch.area(t);
        for (; next < area; next += share) {
            double s = random.unit(), r = random.unit();
            if (s + r > 1) {
                s = 1 - s;
                r = 1 - r;
            }
            const auto at = [&](const auto& values) {
                return values[v[0]] * (1 - s - r) + values[v[1]] * s + values[v[2]] * r;
            };
            result.push_back({at(patch.positions), at(patch.flat), quad, share});
        }
    }
    return result;
}

namespace {

// Distance of every point to the mesh, slab by slab of space for memory's sake. likely: that hardly any exceeds.
std::vector<double> distances_to(const TriMesh& mesh, const std::vector<glm::dvec3>& points, double likely) {
    constexpr size_t triangles_per_slab = 1000000;
    const int axis = bounding_box(mesh.positions).longest_axis();
    std::vector<uint32_t> order(points.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](uint32_t i) { return points[i][axis]; });
    const size_t slabs = 1 + mesh.triangle_count() / triangles_per_slab;
    std::vector<double> distance(points.size());
    std::vector<uint32_t> indices;
    for (size_t slab = 0; slab < slabs; ++slab) {
        const size_t first = points.size() * slab / slabs, last = points.size() * (slab + 1) / slabs;
        if (first == last) continue;
        const double low = points[order[first]][axis] - likely, high = points[order[last - 1]][axis] + likely;
        indices.clear();
        for (size_t t = 0; t < mesh.triangle_count(); ++t) {
            double least = 1e300, most = -1e300;
            for (int k = 0; k < 3; ++k) {
                const auto at = static_cast<double>(mesh.position_of(t, k)[axis]);
                least = std::min(least, at);
                most = std::max(most, at);
            }
            if (slabs > 1 && (most < low || least > high)) continue;
            for (int k = 0; k < 3; ++k) indices.push_back(mesh.vertex_of(t, k));
        }
        std::optional<ClosestSurface> surface;
        if (!indices.empty()) surface.emplace(mesh.positions, indices);
        parallel_for(last - first, 1024, [&](size_t begin, size_t end) {
            for (size_t i = first + begin; i < first + end; ++i) {
                const glm::dvec3& p = points[order[i]];
                double& nearest = distance[order[i]];
                nearest = surface ? surface->closest(p).distance : 1e300;
                if (slabs == 1 || nearest <= likely) continue;
                // Something outside the slab may be nearer.
                for (size_t t = 0; t < mesh.triangle_count(); ++t) {
                    const glm::dvec3 q =
                        closest_on_triangle(p, mesh.position_of(t, 0), mesh.position_of(t, 1), mesh.position_of(t, 2));
                    nearest = std::min(nearest, glm::length(p - q));
                }
            }
        });
    }
    return distance;
}

}  // namespace

AtlasDistance measure_finest(const Atlas& atlas, const TriMesh& source, const std::vector<SourceSample>& samples) {
    if (samples.empty()) return {};
    std::vector<double> forth(samples.size());
    std::vector<glm::dvec3> drawn(samples.size());
    parallel_for(samples.size(), 1024, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const SourceSample& s = samples[i];
            forth[i] = std::sqrt(squared_distance(atlas, s.chart, s.place, s.position));
            Random random(mix64(i + 12345));
            const double x = random.unit(), y = random.unit();
            drawn[i] = image_point(atlas, s.chart, 0, {x, y});
        }
    });
    const std::vector<double> back = distances_to(source, drawn, static_cast<double>(atlas.errors[0]));
    AtlasDistance distance;
    for (const std::vector<double>* side : std::array<const std::vector<double>*, 2>{&forth, &back}) {
        double sum = 0, area = 0;
        for (size_t i = 0; i < samples.size(); ++i) {
            const double d = (*side)[i];
            sum += samples[i].area * d * d;
            area += samples[i].area;
            distance.max = std::max(distance.max, d);
        }
        if (area > 0) distance.rms = std::max(distance.rms, std::sqrt(sum / area));
    }
    return distance;
}

}  // namespace lodestone::vgi
