#include "vgi/draw/attributes/attribute_pages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace lodestone::vgi {
namespace {

// Of a chart with so many cells of positions and four times as many of attributes.
Atlas about_one_chart(uint32_t cells) {
    Atlas about;
    about.cells = cells;
    about.attribute_cells = 4 * cells;
    about.step = 0.5;
    return about;
}
// Its coarsest page, whose samples are a step apart down, and across a step in the left half and four in the right
// half.
GeometryPage page_with_a_wide_half(const Atlas& about) {
    const uint32_t cells = std::min(about.cells, page_cells), step = 10 * about.cells / cells;
    GeometryPage page;
    for (uint32_t y = 0; y <= cells; ++y) {
        for (uint32_t x = 0; x <= cells; ++x) {
            const uint32_t wide = x > cells / 2 ? x - cells / 2 : 0;
            page.push_back({static_cast<uint16_t>(step * (x + 3 * wide)), static_cast<uint16_t>(step * y), 7, 0, 0});
        }
    }
    return page;
}

// What is asked for is as fine as the shader wants it, so a part is as wide as it is at its widest, in its widest way.
TEST(ChartSpacing, IsThatOfThePart) {
    for (const uint32_t cells : {2u, 4u, 8u, 32u, 128u}) {
        SCOPED_TRACE(cells);
        const Atlas about = about_one_chart(cells);
        const ChartSpacing spacing = spacing_of(about, page_with_a_wide_half(about), 0);
        constexpr float narrow = 10 * 0.5f / 4, wide = 4 * narrow;
        EXPECT_NEAR(spacing.mean, std::sqrt(2.5f) * narrow, 1e-5f);
        EXPECT_FLOAT_EQ(spacing.widest_of(0, 0, 0), wide);
        // Parts of parts there are no numbers of are as what holds them.
        for (uint32_t shift = 1; shift < 7; ++shift) {
            for (uint32_t y = 0; y < 1u << shift; ++y) {
                for (uint32_t x = 0; x < 1u << shift; ++x)
                    ASSERT_FLOAT_EQ(spacing.widest_of(shift, x, y), x < 1u << (shift - 1) ? narrow : wide)
                        << shift << " " << x << " " << y;
            }
        }
    }
}

// Cells that are nearly a line would be asked for before all else, and cover hardly a pixel.
TEST(ChartSpacing, IsBoundByTheMean) {
    const Atlas about = about_one_chart(8);
    GeometryPage page = page_with_a_wide_half(about);
    page[4 * 9 + 4].z = 60000;
    const ChartSpacing spacing = spacing_of(about, page, 0);
    for (const float widest : spacing.widest) EXPECT_LE(widest, 8 * spacing.mean);
}

// Whichever way it is stretched: here along a diagonal.
TEST(ChartSpacing, IsThatOfTheWidestWay) {
    Atlas about;
    about.cells = about.attribute_cells = 2;
    GeometryPage page;
    for (uint16_t y = 0; y <= 2; ++y) {
        for (uint16_t x = 0; x <= 2; ++x)
            page.push_back({static_cast<uint16_t>(100 * x + 60 * y), static_cast<uint16_t>(60 * x + 100 * y), 0, 0, 0});
    }
    EXPECT_FLOAT_EQ(spacing_of(about, page, 0).widest_of(0, 0, 0), 160);
}

// What is there is gone into where samples are farther apart than pixels, and the finer pages asked for.
TEST(AttributePages, WantFinerPagesWhereSamplesAreFarApart) {
    Atlas about = about_one_chart(32);
    about.cluster.resize(1);
    about.bounds.resize(1);
    const std::vector<ChartSpacing> spacing{spacing_of(about, page_with_a_wide_half(about), 0)};
    const PageTree tree = tree_of(about, Layer::attributes);
    ASSERT_EQ(tree.base_level(), 2u);
    AttributePages pages(about);
    for (uint32_t page = 0; page < 5; ++page) pages.put(page, std::make_shared<AttributePage>(), page);
    View view;
    view.focal_px = 400;
    CutRequest request;
    request.views = {&view, 1};
    // Samples of level 1 are 2.5 apart, and 10 in the wide half: a pixel, and four.
    request.distance = 1000.0f;
    PageDemand demand(tree.pages());
    const std::vector<uint32_t> charts{0};
    pages.want(about, spacing, request, charts, demand);
    for (uint32_t page = 0; page < 5; ++page) EXPECT_TRUE(demand.touched(page)) << page;
    for (uint32_t y = 0; y < 4; ++y) {
        // Those of level 0 by what is drawn in their place.
        for (uint32_t x = 0; x < 4; ++x)
            EXPECT_NEAR(demand.wish(tree.page(0, x, y)), x < 2 ? 0.0f : 4.0f, 1e-3f) << x << " " << y;
    }
}

// A chart that is folded over: pages of its back are not asked for where faces from behind are not drawn.
TEST(AttributePages, WantNoPagesOfWhatIsSeenFromBehind) {
    Atlas about = about_one_chart(32);
    about.cluster.resize(1);
    about.bounds.resize(1);
    about.bounds[0].centre = {40, 80, 500};
    about.bounds[0].radius = 200;
    GeometryPage page;
    for (uint32_t y = 0; y <= 32; ++y) {
        for (uint32_t x = 0; x <= 32; ++x) {
            const bool back = x > 16;
            page.push_back({static_cast<uint16_t>(10 * (back ? 33 - x : x)), static_cast<uint16_t>(10 * y),
                            static_cast<uint16_t>(back ? 900 : 1000), 0, 0});
        }
    }
    const std::vector<ChartSpacing> spacing{spacing_of(about, page, 0)};
    AttributePages pages(about);
    for (uint32_t i = 0; i < 5; ++i) pages.put(i, std::make_shared<AttributePage>(), i);
    const PageTree tree = tree_of(about, Layer::attributes);
    const std::vector<uint32_t> charts{0};
    for (const bool culls : {false, true}) {
        View view = view_of({.eye = {40, 80, 900}, .target = {40, 80, 0}, .far_plane = 2000}, 1280, 720);
        view.culls_back_faces = culls;
        CutRequest request;
        request.views = {&view, 1};
        request.cull_back_faces = culls;
        PageDemand demand(tree.pages());
        pages.want(about, spacing, request, charts, demand);
        for (uint32_t y = 0; y < 4; ++y) {
            EXPECT_GT(demand.wish(tree.page(0, 0, y)), 1) << culls;
            EXPECT_GT(demand.wish(tree.page(0, 1, y)), 1) << culls;
            EXPECT_EQ(demand.wish(tree.page(0, 3, y)) > 0, !culls) << culls;
        }
    }
}

}  // namespace
}  // namespace lodestone::vgi
