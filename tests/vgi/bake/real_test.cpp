#include <gtest/gtest.h>

#include <cctype>

#include "fixtures/real_data.h"
#include "mesh/io/read.h"
#include "mesh/repair.h"
#include "mesh/topology.h"
#include "vgi/bake/bake.h"
#include "vgi/extract/extract.h"

namespace lodestone::vgi {
namespace {

// Any mesh a user has becomes a sound atlas, at few clusters and at many.
class RealAtlas : public testing::TestWithParam<const char*> {};

TEST_P(RealAtlas, IsValidAndTheSurfaceItWas) {
    if (!fixtures::real_data(GetParam())) GTEST_SKIP() << fixtures::missing_data_note(GetParam());
    const auto mesh = fixtures::repaired_real_mesh(GetParam());
    ASSERT_TRUE(mesh) << mesh.error().message;
    const Topology before = topology_of(*mesh);
    for (const uint32_t clusters : {6u, 60u}) {
        SCOPED_TRACE(clusters);
        AtlasOptions options;
        options.clusters.clusters = clusters;
        options.cells = 16;
        options.error_samples = 5000;
        AtlasReport report;
        const auto atlas = make_atlas(*mesh, options, report);
        ASSERT_TRUE(atlas) << atlas.error().message;
        const auto valid = atlas->validate();
        EXPECT_TRUE(valid) << valid.error().message;
        EXPECT_EQ(report.flipped_triangles, 0u);
        EXPECT_GE(report.clusters, clusters);
        const Topology after = topology_of(extract_samples(*atlas, 1));
        EXPECT_TRUE(after.manifold());
        EXPECT_EQ(after.inconsistent_edges, 0u);
        EXPECT_EQ(after.components, before.components);
        EXPECT_EQ(after.boundary_loops, before.boundary_loops);
        EXPECT_EQ(after.genus, before.genus);
    }
}

INSTANTIATE_TEST_SUITE_P(Scans, RealAtlas,
                         testing::Values("scans/stanford-bunny.obj", "scans/horse.ply", "scans/laurana.ply",
                                         "scans/falconstatue_boundary.obj", "nasty/cow.off", "nasty/moebius.obj",
                                         "nasty/mite.obj", "nasty/camel_b.obj", "nasty/soup.stl", "nasty/brain.ply",
                                         "nasty/boeing.off", "gltf/DamagedHelmet/DamagedHelmet.glb"),
                         [](const auto& test) { return fixtures::test_name_of(test.param); });

// Parts of machines, with fans of needles around vertices of hundreds of triangles: they were baked for minutes, in
// thousands of clusters.
class MachinePart : public testing::TestWithParam<const char*> {};

TEST_P(MachinePart, TakesNoMoreClustersThanItsShapeAsksFor) {
    if (!fixtures::real_data(GetParam())) GTEST_SKIP() << fixtures::missing_data_note(GetParam());
    const auto mesh = fixtures::repaired_real_mesh(GetParam());
    ASSERT_TRUE(mesh) << mesh.error().message;
    AtlasOptions options;
    options.clusters.clusters = 20;
    options.cells = 16;
    options.error_samples = 5000;
    options.most_rounds = 1;
    AtlasReport report;
    const auto atlas = make_atlas(*mesh, options, report);
    ASSERT_TRUE(atlas) << atlas.error().message;
    EXPECT_TRUE(atlas->validate());
    EXPECT_LE(report.rounds, 3u);
    EXPECT_LT(report.clusters, mesh->triangle_count() / 20);
}

INSTANTIATE_TEST_SUITE_P(Nasty, MachinePart,
                         testing::Values("nasty/112932.stl", "nasty/Generic_Twin_7081.1.t0_left.obj"),
                         [](const auto& test) { return fixtures::test_name_of(test.param); });

}  // namespace
}  // namespace lodestone::vgi
