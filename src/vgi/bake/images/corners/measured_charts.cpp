#include "vgi/bake/images/corners/measured_charts.h"

#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

namespace lodestone::vgi {

namespace {

// Where a triangle is measured, its edges divided by four: how far along its first edge, how far along its last. Its
// corners are places of charts.
constexpr std::array<glm::dvec2, 12> tried_places{{{0, 0.25},
                                                   {0, 0.5},
                                                   {0, 0.75},
                                                   {0.25, 0},
                                                   {0.25, 0.25},
                                                   {0.25, 0.5},
                                                   {0.25, 0.75},
                                                   {0.5, 0},
                                                   {0.5, 0.25},
                                                   {0.5, 0.5},
                                                   {0.75, 0},
                                                   {0.75, 0.25}}};

constexpr std::array<glm::dvec2, 6> uphill{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, -1}, {-1, 1}}};
// Of the largest distance that is known: where a triangle has as much, more is looked for.
constexpr double foot = 0.8;

ClosestSurface grids_of(const Atlas& atlas) {
    std::vector<glm::vec3> positions;
    std::vector<uint32_t> indices;
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const uint32_t cells = measured_cells(atlas, c), step = atlas.cells_of(c) / cells;
        const auto first = static_cast<uint32_t>(positions.size());
        for (uint32_t y = 0; y <= cells; ++y) {
            for (uint32_t x = 0; x <= cells; ++x)
                positions.emplace_back(atlas.point(atlas.texel(c, x * step, y * step)));
        }
        for (uint32_t y = 0; y < cells; ++y) {
            for (uint32_t x = 0; x < cells; ++x) {
                const uint32_t a = first + y * (cells + 1) + x, d = a + cells + 1;
                indices.insert(indices.end(), {a, a + 1, d + 1, a, d + 1, d});
            }
        }
    }
    return {positions, indices};
}

}  // namespace

uint32_t measured_cells(const Atlas& atlas, uint32_t chart) {
    const uint32_t most = atlas.charts() <= 2000 ? 8 : atlas.charts() <= 20000 ? 4 : 2;
    return std::min(most, atlas.cells_of(chart));
}

MeasuredCharts::MeasuredCharts(const Atlas& atlas) : charts_(grids_of(atlas)) {}

double MeasuredCharts::squared_off(const std::array<glm::dvec3, 3>& triangle, double worst, uint32_t& hint) const {
    const glm::dvec3 &a = triangle[0], ab = triangle[1] - a, ac = triangle[2] - a;
    double most = foot * std::sqrt(worst);
    std::optional<glm::dvec2> top;
    const auto look = [&](const glm::dvec2& place) {
        const ClosestSurface::Hit hit = charts_.closest(a + place.x * ab + place.y * ac, hint, most);
        hint = hit.triangle;
        if (!(hit.distance > most)) return false;
        most = hit.distance;
        top = place;
        return true;
    };
    for (const glm::dvec2& place : tried_places) look(place);
    for (double step = 0.125; top && step > 0.03; step /= 2) {
        for (bool higher = true; higher;) {
            const glm::dvec2 from = *top;
            higher = false;
            for (const glm::dvec2& by : uphill) {
                const glm::dvec2 place = from + step * by;
                if (place.x >= 0 && place.y >= 0 && place.x + place.y <= 1) higher |= look(place);
            }
        }
    }
    return std::max(worst, most * most);
}

}  // namespace lodestone::vgi
