// Limits of atlases, made small where they are baked.
#include "mesh/limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixtures/meshes.h"
#include "vgi/bake/bake.h"

namespace lodestone::vgi {
namespace {

TEST(AtlasLimits, ArePassedByNoAtlasAndNamedWithTheNumber) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 2000);
    AtlasOptions options;
    options.clusters.clusters = 8;
    options.cells = 8;
    Limits limits;
    const auto made = [&] {
        AtlasReport report;
        return make_atlas(mesh, options, report, {}, nullptr, limits);
    };
    const auto all = made();
    ASSERT_TRUE(all);
    limits.charts = all->charts();
    EXPECT_TRUE(made());
    --limits.charts;
    const auto refused = made();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().fault, Fault::format);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("has " + std::to_string(all->charts()) +
                                                            " charts; the limit is " + std::to_string(limits.charts)));
}

}  // namespace
}  // namespace lodestone::vgi
