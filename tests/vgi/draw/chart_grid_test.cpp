// What shaders find in the grid of charts, against all charts looked through.
#include "vgi/draw/corners/chart_grid.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/distance/closest_point.h"
#include "mesh/generate.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

double distance_to(const Atlas& atlas, uint32_t chart, const glm::dvec3& at) {
    glm::dvec3 p[4];
    for (uint32_t k = 0; k < 4; ++k) {
        const auto& own = atlas.corners[atlas.chart_corners[chart][k]].position;
        p[k] = glm::dvec3(own[0], own[1], own[2]);
    }
    return std::min(glm::distance(at, closest_on_triangle(at, p[0], p[1], p[2])),
                    glm::distance(at, closest_on_triangle(at, p[0], p[2], p[3])));
}

// As shaders/shared/vgi_place.glsl has it; lattice units.
std::vector<uint32_t> charts_at(const std::vector<CornerRecord>& table, const glm::dvec3& at) {
    const glm::uvec3 size(table[0][0], table[0][1], table[0][2]);
    const double side = static_cast<double>(std::bit_cast<float>(table[0][3]));
    const glm::uvec3 cell = glm::min(glm::uvec3(glm::max(at, glm::dvec3(0)) / side), size - 1u);
    const size_t first = 1 + LODE_VGI_GRID_CHARTS / 4 * ((cell.z * size.y + cell.y) * size.x + cell.x);
    std::vector<uint32_t> charts;
    for (uint32_t k = 0; k < LODE_VGI_GRID_CHARTS; ++k) charts.push_back(table[first + k / 4][k % 4]);
    return charts;
}

TEST(ChartGrid, HasTheChartThatIsNearestWhereverOneLooks) {
    for (const Shape shape : {Shape::rock, Shape::torus, Shape::vase}) {
        const Atlas atlas = small_atlas(fixtures::repaired(shape, 20000), 8, 100);
        const auto table = chart_grid(atlas);
        const glm::uvec3 size(table[0][0], table[0][1], table[0][2]);
        ASSERT_EQ(table.size(), 1 + LODE_VGI_GRID_CHARTS / 4 * size_t{size.x} * size.y * size.z);
        ASSERT_LE(table.size() * sizeof(CornerRecord), size_t{1} << 20);
        const double side = static_cast<double>(std::bit_cast<float>(table[0][3]));
        Random random(5);
        size_t places = 0, right = 0;
        double worst = 0;
        for (uint32_t i = 0; i < 4000; ++i) {
            // Next to the surface, where triangles of moved corners are.
            const auto& own = atlas.positions[random.below(static_cast<uint32_t>(atlas.positions.size()))];
            const auto off = [&] { return side * (random.below(2000) / 1000.0 - 1) / 2; };
            const glm::dvec3 at = glm::dvec3(own[0], own[1], own[2]) + glm::dvec3(off(), off(), off());
            double least = 1e30, found = 1e30;
            for (uint32_t c = 0; c < atlas.charts(); ++c) least = std::min(least, distance_to(atlas, c, at));
            for (const uint32_t c : charts_at(table, at)) {
                if (c == LODE_VGI_NO_CHART) break;
                ASSERT_LT(c, atlas.charts());
                found = std::min(found, distance_to(atlas, c, at));
            }
            ++places;
            right += found <= least * (1 + 1e-9);
            worst = std::max(worst, (found - least) / side);
        }
        std::printf("%u charts, %ux%ux%u cells: %.4f right, %.3f cells farther at most\n", atlas.charts(), size.x,
                    size.y, size.z, static_cast<double>(right) / static_cast<double>(places), worst);
        EXPECT_GT(right, places * 9 / 10);
        EXPECT_LT(worst, 0.5);
    }
}

TEST(ChartGrid, IsNothingWithoutCorners) {
    Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 2000), 8, 8);
    atlas.corners.clear();
    EXPECT_TRUE(chart_grid(atlas).empty());
}

}  // namespace
}  // namespace lodestone::vgi
