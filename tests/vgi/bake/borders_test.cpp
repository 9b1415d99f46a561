#include "vgi/bake/images/borders.h"

#include <gtest/gtest.h>

#include <array>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace lodestone::vgi {
namespace {

constexpr uint32_t cells = 8;

// Four charts around a vertex in the plane z = 0, from which straight borders lead, each given by its first sample.
struct Star {
    Surface surface;
    ChartComplex patches;
    Atlas atlas;

    explicit Star(const std::array<glm::dvec2, 4>& first) {
        // Vertices: the middle, the ends of the borders, the charts' corners across from the middle.
        surface.positions.emplace_back(0.85, 0.79, 0);
        for (const glm::dvec2& p : first)
            surface.positions.push_back(surface.positions[0] + glm::dvec3(p * double{cells}, 0.0));
        for (uint32_t k = 0; k < 4; ++k)
            surface.positions.push_back(surface.positions[1 + k] + surface.positions[1 + (k + 1) % 4]);
        const auto arc = [&](uint32_t from, uint32_t to, uint32_t left, uint32_t right) {
            Arc made{{from, to}, left, right, glm::distance(surface.positions[from], surface.positions[to])};
            patches.arcs.push_back(made);
        };
        for (uint32_t k = 0; k < 4; ++k) arc(0, 1 + k, k, (k + 3) % 4);
        for (uint32_t k = 0; k < 4; ++k) {
            arc(1 + k, 5 + k, k, none);
            arc(5 + k, 1 + (k + 1) % 4, k, none);
            patches.sides.push_back({{k, false}, {4 + 2 * k, false}, {5 + 2 * k, false}, {(k + 1) % 4, true}});
        }
        atlas.cells = atlas.attribute_cells = cells;
        atlas.origin = glm::dvec3(-1000);
        atlas.lay_out({0, 0, 0, 0}, {0, 0, 0, 0});
    }
    // Of a chart's corner in the middle: twice the area between its first samples, on the lattice.
    double opening(const Borders& borders, uint32_t chart) const {
        const glm::dvec3 middle = atlas.rounded(surface.positions[0]),
                         a = atlas.rounded(borders.at(chart, 1).position) - middle,
                         b = atlas.rounded(borders.at((chart + 1) % 4, 1).position) - middle;
        return a.x * b.y - a.y * b.x;
    }
};

TEST(Borders, CornersOfHeightFieldsStayOpenWhenTheyAreRounded) {
    // Between the first two there are nine degrees less than none when they are rounded.
    const std::array<glm::dvec2, 4> first{{{15.47, -5.8}, {6.55, -2.31}, {4.5, 17.26}, {-6, 6.12}}};
    const Star star(first);
    Borders borders(star.surface, star.patches, star.atlas);
    const Borders before = borders;
    ASSERT_GT(first[0].x * first[1].y - first[0].y * first[1].x, 0);
    ASSERT_LE(star.opening(borders, 0), 0) << "nothing there to open";
    borders.keep_corners_open(star.patches, star.atlas, {}, {0, 0, 1});
    uint32_t moved = 0;
    for (uint32_t arc = 0; arc < star.patches.arcs.size(); ++arc) {
        for (uint32_t k = 0; k <= cells; ++k) {
            const glm::dvec3 by = glm::abs(borders.at(arc, k).position - before.at(arc, k).position);
            if (by == glm::dvec3(0)) continue;
            moved += arc < 4 && k == 1;
            EXPECT_TRUE(k == 1 || k + 1 == cells) << "only samples next to corners move";
            EXPECT_LE(std::max(by.x, by.y), 3.5);
            EXPECT_EQ(by.z, 0);
        }
    }
    EXPECT_EQ(moved, 1u);
    for (const uint32_t chart : {0u, 1u, 2u}) EXPECT_GT(star.opening(borders, chart), 0) << chart;
    EXPECT_LT(star.opening(borders, 3), 0) << "wider than half a turn, and as it was";
}

TEST(Borders, SamplesThatRoundingMakesOneGiveWay) {
    const Star star({{{4000, 0}, {4000, 0.0001}, {0, 40}, {-40, -20}}});
    Borders borders(star.surface, star.patches, star.atlas);
    ASSERT_EQ(star.opening(borders, 0), 0);
    borders.keep_corners_open(star.patches, star.atlas, {}, {0, 0, 1});
    EXPECT_GT(star.opening(borders, 0), 0);
}

}  // namespace
}  // namespace lodestone::vgi
