#include "vgi/bake/charts/quadrangulate.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "fixtures/meshes.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/charts/clusters.h"

namespace lodestone::vgi {
namespace {

TEST(Quadrangulate, MakesFourSidedDisksThatCoverTheSurface) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        for (const uint32_t wanted : {1u, 8u, 30u}) {
            SCOPED_TRACE(f.name + " " + std::to_string(wanted));
            const Surface surface = surface_of(f.mesh);
            ClusterOptions options;
            options.clusters = wanted;
            const auto clusters = make_clusters(surface, options);
            ASSERT_TRUE(clusters);
            const auto quads = quadrangulate(surface, *clusters);
            ASSERT_TRUE(quads) << quads.error().message;
            ASSERT_TRUE(quads->failed.empty()) << quads->fault;
            const auto valid = quads->surface.validate();
            ASSERT_TRUE(valid) << valid.error().message;
            EXPECT_NEAR(quads->surface.area(), surface.area(), 1e-9 * surface.area());
            const auto patches = trace_charts(quads->surface, quads->surface.twins(), quads->label,
                                              static_cast<uint32_t>(quads->quads.size()), quads->corners());
            ASSERT_TRUE(patches) << patches.error().message;
            for (size_t q = 0; q < quads->quads.size(); ++q) {
                ASSERT_EQ(patches->sides[q].size(), 4u) << q;
                std::vector<uint32_t> corners;
                for (const Side& side : patches->sides[q]) {
                    const auto& v = patches->arcs[side.arc].vertices;
                    corners.push_back(side.reversed ? v.back() : v.front());
                }
                const auto& wantedcorners = quads->quads[q].corners;
                const auto first = std::ranges::find(corners, wantedcorners[0]);
                ASSERT_NE(first, corners.end());
                std::rotate(corners.begin(), first, corners.end());
                EXPECT_TRUE(std::ranges::equal(corners, wantedcorners)) << q;
            }
        }
    }
}

// A lid whose every edge is a border, as between small parts of machines: rays to each cross what others cut.
TEST(Quadrangulate, HalvesClustersOfManySides) {
    constexpr uint32_t around = 200;
    const Surface surface = surface_of(fixtures::drum(around, 3));
    Clusters clusters;
    clusters.count = 2 + around;
    for (const SurfaceTriangle& t : surface.triangles) {
        const auto& v = t.vertices;
        const bool lower = std::ranges::find(v, 0u) != v.end(), upper = std::ranges::find(v, 1u) != v.end();
        clusters.label.push_back(lower ? 0 : upper ? 1 : 2 + t.source / 4);
    }
    const auto quads = quadrangulate(surface, clusters);
    ASSERT_TRUE(quads) << quads.error().message;
    ASSERT_TRUE(quads->failed.empty()) << quads->fault;
    ASSERT_TRUE(quads->surface.validate());
    EXPECT_NEAR(quads->surface.area(), surface.area(), 1e-9 * surface.area());
    EXPECT_LT(quads->surface.triangles.size(), 60 * surface.triangles.size()) << "it was 1000 times";
    for (const auto& quad : quads->quads) EXPECT_LT(quad.cluster, clusters.count);
    const auto patches = trace_charts(quads->surface, quads->surface.twins(), quads->label,
                                      static_cast<uint32_t>(quads->quads.size()), quads->corners());
    EXPECT_TRUE(patches) << patches.error().message;
}

// Length of borders that end on the surface's boundary.
double borders_inwards(const Quads& quads) {
    const auto twin = quads.surface.twins();
    const auto patches =
        trace_charts(quads.surface, twin, quads.label, static_cast<uint32_t>(quads.quads.size()), quads.corners());
    EXPECT_TRUE(patches);
    std::vector<bool> outer(quads.surface.positions.size(), false);
    for (uint32_t h = 0; h < twin.size(); ++h) {
        if (twin[h] == none) outer[quads.surface.triangles[h / 3].vertices[h % 3]] = true;
    }
    double length = 0;
    for (const Arc& arc : patches->arcs) {
        if (arc.left != none && arc.right != none && (outer[arc.vertices.front()] || outer[arc.vertices.back()]))
            length += arc.length;
    }
    return length;
}

TEST(Recentre, MakesBordersStraightUpToTheBoundary) {
    const Surface surface = surface_of(fixtures::repaired(Shape::terrain, 20000));
    ClusterOptions options;
    options.clusters = 40;
    const auto clusters = make_clusters(surface, options);
    ASSERT_TRUE(clusters);
    auto quads = quadrangulate(surface, *clusters);
    ASSERT_TRUE(quads && quads->failed.empty());
    const double before = borders_inwards(*quads);
    for (const Pivot pivot : {Pivot::outer_middles, Pivot::corners, Pivot::centres}) {
        ASSERT_TRUE(recentre(*quads, pivot));
        ASSERT_TRUE(quads->surface.validate());
        EXPECT_NEAR(quads->surface.area(), surface.area(), 1e-9 * surface.area());
        const auto patches = trace_charts(quads->surface, quads->surface.twins(), quads->label,
                                          static_cast<uint32_t>(quads->quads.size()), quads->corners());
        ASSERT_TRUE(patches) << patches.error().message;
        EXPECT_TRUE(std::ranges::all_of(patches->sides, [](const auto& sides) { return sides.size() == 4; }));
    }
    EXPECT_LT(borders_inwards(*quads), 0.95 * before);
}

}  // namespace
}  // namespace lodestone::vgi
