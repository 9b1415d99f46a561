// Boxes around charts.
#include "vgi/draw/corners/chart_boxes.h"

#include <gtest/gtest.h>

#include "fixtures/meshes.h"
#include "mesh/generate.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

struct Found {
    std::array<uint32_t, 3> low{65535, 65535, 65535}, high{};
    uint32_t deepest = 0;
};

// Counts each chart; what is in a box, and by how many more boxes at most.
Found look_into(const Atlas& atlas, const std::vector<CornerRecord>& table, uint32_t number,
                std::vector<uint32_t>& times) {
    Found found;
    const auto add = [&](const std::array<uint32_t, 3>& low, const std::array<uint32_t, 3>& high) {
        for (size_t k = 0; k < 3; ++k) {
            found.low[k] = std::min(found.low[k], low[k]);
            found.high[k] = std::max(found.high[k], high[k]);
        }
    };
    const CornerRecord& box = table.at(number);
    if ((box[3] & LODE_VGI_BOX_OF_CHART) != 0) {
        const uint32_t chart = box[3] & ~LODE_VGI_BOX_OF_CHART;
        ++times.at(chart);
        for (const uint32_t corner : atlas.chart_corners[chart]) {
            const auto& p = atlas.corners[corner].position;
            add({p[0], p[1], p[2]}, {p[0], p[1], p[2]});
        }
    } else {
        for (const uint32_t child : {box[3], box[3] + 1}) {
            EXPECT_GT(child, number);
            const Found in = look_into(atlas, table, child, times);
            add(in.low, in.high);
            found.deepest = std::max(found.deepest, in.deepest + 1);
        }
    }
    for (size_t k = 0; k < 3; ++k) EXPECT_EQ(box[k], found.low[k] | found.high[k] << 16) << number;
    return found;
}

TEST(ChartBoxes, HoldEveryChartOnceAndNothingElse) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        const Atlas atlas = small_atlas(f.mesh, 8, 24);
        const auto table = chart_boxes(atlas);
        ASSERT_EQ(table.size(), 2 * size_t{atlas.charts()} - 1);
        std::vector<uint32_t> times(atlas.charts(), 0);
        const Found all = look_into(atlas, table, 0, times);
        EXPECT_EQ(times, std::vector<uint32_t>(atlas.charts(), 1));
        // What shaders have room for grows with the depth, and halves are halves.
        EXPECT_LT(1u << all.deepest, 2 * atlas.charts());
    }
}

TEST(ChartBoxes, AreNoneWithoutCorners) {
    Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 2000), 8, 8);
    atlas.corners.clear();
    EXPECT_TRUE(chart_boxes(atlas).empty());
}

}  // namespace
}  // namespace lodestone::vgi
