#include "vgi/bake/quads/quadrangulate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "fixtures/meshes.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/charts/clusters.h"

namespace lodestone::vgi {
namespace {

Result<Clusters> clusters_of(const Surface& surface, uint32_t wanted) {
    ClusterOptions options;
    options.clusters = wanted;
    return make_clusters(surface, options);
}

TEST(Quadrangulate, MakesFourSidedDisksThatCoverTheSurface) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        for (const uint32_t wanted : {1u, 8u, 30u}) {
            SCOPED_TRACE(f.name + " " + std::to_string(wanted));
            const Surface surface = surface_of(f.mesh);
            const auto clusters = clusters_of(surface, wanted);
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

// A closed prism of `around` sides whose lids are strips of needles, from one side of the rim to the other and back.
TriMesh prism_of_needles(uint32_t around) {
    TriMesh mesh = fixtures::drum(static_cast<int>(around), 3);
    std::erase_if(mesh.triangles, [](const Triangle& t) { return t[0] < 2; });  // those at the middle of a lid
    for (uint32_t up = 0; up < 2; ++up) {
        uint32_t low = 0, high = around - 1;
        for (bool at_low = true; low + 1 < high; at_low = !at_low) {
            const uint32_t next = at_low ? low + 1 : high - 1;
            const auto rim = [&](uint32_t i) { return 2 + 2 * i + up; };
            if (up == 0) {
                mesh.triangles.push_back({rim(low), rim(next), rim(high)});
            } else {
                mesh.triangles.push_back({rim(low), rim(high), rim(next)});
            }
            (at_low ? low : high) = next;
        }
    }
    drop_unreferenced(mesh);
    return mesh;
}

// Lids whose every edge is a border, as between small parts of machines: rays to each cross what others cut.
TEST(Quadrangulate, HalvesClustersOfManySides) {
    constexpr uint32_t around = 200;
    // With times as many triangles at most. Of needles there are 66 times as many, and 1,506 if nothing is halved; of a
    // fan 40 times, and 5.
    for (const auto& [mesh, most_times] :
         {std::pair(fixtures::drum(around, 3), 60u), std::pair(prism_of_needles(around), 100u)}) {
        const Surface surface = surface_of(mesh);
        ASSERT_TRUE(surface.validate()) << surface.validate().error().message;
        Clusters clusters;
        for (const SurfaceTriangle& t : surface.triangles) {
            const auto height = [&](uint32_t k) { return surface.positions[t.vertices[k]].y; };
            const bool is_lid = height(0) == height(1) && height(1) == height(2);
            const auto x = [&](uint32_t k) { return surface.positions[t.vertices[k]]; };
            const glm::dvec3 middle = (x(0) + x(1) + x(2)) / 3.0;
            const double turn = std::atan2(middle.z, middle.x) / (2 * std::numbers::pi);
            const auto side = static_cast<uint32_t>((turn + 1) * around) % around;
            clusters.label.push_back(is_lid ? (height(0) > 0 ? 1 : 0) : 2 + side);
        }
        clusters.count = 2 + around;
        const auto quads = quadrangulate(surface, clusters);
        ASSERT_TRUE(quads) << quads.error().message;
        ASSERT_TRUE(quads->failed.empty()) << quads->fault;
        ASSERT_TRUE(quads->surface.validate());
        EXPECT_NEAR(quads->surface.area(), surface.area(), 1e-9 * surface.area());
        EXPECT_LT(quads->surface.triangles.size(), most_times * surface.triangles.size());
        for (const auto& quad : quads->quads) EXPECT_LT(quad.cluster, clusters.count);
        const auto patches = trace_charts(quads->surface, quads->surface.twins(), quads->label,
                                          static_cast<uint32_t>(quads->quads.size()), quads->corners());
        EXPECT_TRUE(patches) << patches.error().message;
    }
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

TEST(Quadrangulate, EndsWhereItIsStopped) {
    const Surface surface = surface_of(fixtures::repaired(Shape::rock, 4000));
    const auto clusters = clusters_of(surface, 12);
    ASSERT_TRUE(clusters);
    std::atomic<bool> stop = true;
    Progress progress;
    progress.stop = &stop;
    const auto stopped = quadrangulate(surface, *clusters, progress);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().fault, Fault::interrupted);
    stop = false;
    auto quads = quadrangulate(surface, *clusters, progress);
    ASSERT_TRUE(quads && quads->failed.empty());
    stop = true;
    const auto left = recentre(*quads, Pivot::corners, {}, progress);
    ASSERT_FALSE(left);
    EXPECT_EQ(left.error().fault, Fault::interrupted);
}

TEST(Recentre, MakesBordersStraightUpToTheBoundary) {
    const Surface surface = surface_of(fixtures::repaired(Shape::terrain, 20000));
    const auto clusters = clusters_of(surface, 40);
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
