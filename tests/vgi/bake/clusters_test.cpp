#include "vgi/bake/charts/clusters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "base/random.h"
#include "base/threads.h"
#include "fixtures/meshes.h"
#include "fixtures/real_data.h"
#include "mesh/generate.h"
#include "mesh/io/read.h"
#include "mesh/repair.h"
#include "mesh/topology.h"
#include "vgi/bake/charts/chart_complex.h"

namespace lodestone::vgi {
namespace {

TEST(Surface, SplitsInnerEdgesBetweenBoundaryVerticesAndKeepsTheArea) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        SurfaceChanges changes;
        const Surface surface = surface_of(f.mesh, 0, &changes);
        const auto valid = surface.validate();
        ASSERT_TRUE(valid) << valid.error().message;
        EXPECT_EQ(surface.positions.size(),
                  f.mesh.vertex_count() + changes.boundary_chords + 2 * changes.lone_triangles);
        double area = 0;
        for (size_t t = 0; t < f.mesh.triangle_count(); ++t)
            area +=
                glm::length(glm::cross(glm::dvec3(f.mesh.position_of(t, 1)) - glm::dvec3(f.mesh.position_of(t, 0)),
                                       glm::dvec3(f.mesh.position_of(t, 2)) - glm::dvec3(f.mesh.position_of(t, 0)))) /
                2;
        EXPECT_NEAR(surface.area(), area, 1e-9 * area);
        std::vector<bool> rim(surface.positions.size(), false);
        const auto twin = surface.twins();
        const auto end = [&](uint32_t h, uint32_t k) { return surface.triangles[h / 3].vertices[(h % 3 + k) % 3]; };
        for (uint32_t h = 0; h < twin.size(); ++h)
            if (twin[h] == none) rim[end(h, 0)] = rim[end(h, 1)] = true;
        for (uint32_t h = 0; h < twin.size(); ++h) {
            EXPECT_FALSE(twin[h] != none && rim[end(h, 0)] && rim[end(h, 1)]);
        }
    }
}

TEST(Surface, HalvesLongEdgesAndMakesFourOfALoneTriangle) {
    TriMesh mesh = fixtures::tetrahedron();
    const double longest = 0.2 * bounding_box(mesh.positions).diagonal();
    SurfaceChanges changes;
    const Surface fine = surface_of(mesh, longest, &changes);
    ASSERT_TRUE(fine.validate());
    EXPECT_GT(changes.long_edges, 20u);
    EXPECT_NEAR(fine.area(), surface_of(mesh).area(), 1e-9);
    for (const SurfaceTriangle& t : fine.triangles) {
        for (size_t k = 0; k < 3; ++k)
            EXPECT_LE(glm::length(fine.positions[t.vertices[(k + 1) % 3]] - fine.positions[t.vertices[k]]), longest);
    }
    mesh.triangles.resize(1);
    drop_unreferenced(mesh);
    const Surface lone = surface_of(mesh, 0, &changes);
    EXPECT_EQ(changes.lone_triangles, 1u);
    EXPECT_EQ(lone.triangles.size(), 4u);
    EXPECT_TRUE(CellComplex(lone).validate());
}

TEST(Surface, LeavesNeedlesLong) {
    const TriMesh needles = fixtures::drum(2000, 20000);
    SurfaceChanges changes;
    const Surface surface = surface_of(needles, 0.5, &changes);
    ASSERT_TRUE(surface.validate());
    EXPECT_GT(changes.long_edges, 4000u) << "the longest are halved";
    EXPECT_LT(surface.triangles.size(), 4 * needles.triangle_count() + 10000);
}

// A vertex of more triangles than some bound was once a wall that no cluster grew across.
TEST(Clusters, GrowAcrossVerticesOfManyTriangles) {
    for (const int around : {30, 100, 700}) {
        const Surface surface = surface_of(fixtures::drum(around, 3));
        ClusterOptions options;
        options.clusters = 8;
        const auto clusters = make_clusters(surface, options);
        ASSERT_TRUE(clusters);
        EXPECT_LE(clusters->count, 24u) << around;
    }
}

TEST(CellComplex, KeepsItsInvariantThroughEveryMerge) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        if (f.mesh.triangle_count() > 800) continue;
        SCOPED_TRACE(f.name);
        CellComplex complex(surface_of(f.mesh));
        ASSERT_TRUE(complex.validate()) << complex.validate().error().message;
        Random random(9);
        for (int tries = 0; tries < 3000; ++tries) {
            const uint32_t e = random.below(complex.edge_slots());
            if (!complex.edge_alive(e) || !complex.may_merge(e)) continue;
            complex.merge(e);
            const auto valid = complex.validate();
            ASSERT_TRUE(valid) << valid.error().message;
        }
    }
}

TEST(CellComplex, AddsUpMomentsToThoseOfTheWhole) {
    const TriMesh mesh = fixtures::grid(8, 8);
    CellComplex complex(surface_of(mesh));
    for (uint32_t e = 0; e < complex.edge_slots(); ++e) {
        if (complex.edge_alive(e) && complex.may_merge(e)) complex.merge(e);
    }
    double area = 0;
    for (uint32_t c = 0; c < complex.triangle_cells(); ++c) {
        if (!complex.alive(c)) continue;
        EXPECT_NEAR(complex.moments(c).flatness(), 0, 1e-12);
        area += complex.moments(c).area;
    }
    EXPECT_NEAR(area, surface_of(mesh).area(), 1e-9);
}

TEST(Clusters, ReachTheCountWantedOrWhatComponentsNeed) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        for (const uint32_t wanted : {1u, 6u, 12u, 40u, 60u}) {
            SCOPED_TRACE(f.name + " " + std::to_string(wanted));
            const Surface surface = surface_of(f.mesh);
            ClusterOptions options;
            options.clusters = wanted;
            if (wanted % 20 == 0) options.bucket_triangles = wanted * 4;
            const auto clusters = make_clusters(surface, options);
            ASSERT_TRUE(clusters);
            EXPECT_GE(clusters->count, std::min<size_t>(wanted, surface.triangles.size()));
            const auto others = static_cast<uint32_t>(topology_of(f.mesh).components) - 1;
            EXPECT_LE(clusters->count, std::max(2 * wanted, 16u) + 4 * others);
            const auto patches =
                trace_charts(surface, surface.twins(), clusters->label, clusters->count, clusters->ready_corners());
            EXPECT_TRUE(patches) << patches.error().message;
        }
    }
}

// Large buckets begin with rounds of pairs; one bucket for all does without.
TEST(Clusters, AreAsGoodWhereTheyBeginAsPairs) {
    for (const uint64_t seed : {1, 2, 3}) {
        const Surface surface = surface_of(generate(Shape::terrain, 60000, seed));
        const std::vector<uint32_t> twin = surface.twins();
        const auto border = [&](uint32_t bucket_triangles) {
            ClusterOptions options;
            options.clusters = 12;
            options.bucket_triangles = bucket_triangles;
            const auto clusters = make_clusters(surface, options);
            EXPECT_TRUE(clusters);
            EXPECT_EQ(clusters->buckets > 1, bucket_triangles < 60000);
            EXPECT_TRUE(trace_charts(surface, twin, clusters->label, clusters->count));
            double length = 0;
            for (uint32_t h = 0; h < twin.size(); ++h) {
                if (twin[h] != none && clusters->label[h / 3] != clusters->label[twin[h] / 3])
                    length += surface.length(h);
            }
            return length;
        };
        EXPECT_LT(border(20000), 1.15 * border(100000)) << seed;
    }
}

TEST(Clusters, StayWhereNoneNearbyWasBad) {
    const TriMesh mesh = generate(Shape::terrain, 20000);
    const Surface surface = surface_of(mesh);
    for (const uint32_t bucket_triangles : {200000u, 3000u}) {
        ClusterOptions options;
        options.clusters = 60;
        options.bucket_triangles = bucket_triangles;
        const auto before = make_clusters(surface, options);
        ASSERT_TRUE(before);
        const uint32_t wrong = before->count / 2;
        std::vector<bool> bad(before->count, false);
        bad[wrong] = true;
        for (const uint32_t label : before->label) options.density.push_back(label == wrong ? 4.0f : 1.0f);
        const std::vector<uint32_t> kept = options.kept = kept_clusters(surface, before->label, bad);
        const auto after = make_clusters(surface, options);
        ASSERT_TRUE(after);
        EXPECT_GT(after->count, before->count);
        // Per cluster that stays: what it is called now.
        std::vector<uint32_t> now(before->count, none), pieces(after->count, 0);
        std::vector<bool> near(before->count, true);
        for (size_t t = 0; t < kept.size(); ++t) {
            if (kept[t] == none) {
                if (before->label[t] == wrong) ++pieces[after->label[t]];
                continue;
            }
            near[kept[t]] = false;
            if (now[kept[t]] == none) now[kept[t]] = after->label[t];
            EXPECT_EQ(now[kept[t]], after->label[t]);
        }
        EXPECT_TRUE(near[wrong]);
        EXPECT_GE(std::ranges::count_if(pieces, [](uint32_t n) { return n > 0; }), 2);
        const auto again = static_cast<uint32_t>(std::ranges::count(near, true));
        EXPECT_GE(again, 4u) << "what is around it, too";
        EXPECT_LE(again, 16u);
        std::ranges::sort(now);
        EXPECT_EQ(std::ranges::adjacent_find(now, [](uint32_t a, uint32_t b) { return a == b && a != none; }),
                  now.end())
            << "two that stay are one now";
    }
}

TEST(Clusters, WhatATriangleCannotBeCutIntoIsNotMadeElsewhere) {
    const TriMesh mesh = generate(Shape::terrain, 20000);
    const Surface surface = surface_of(mesh);
    ClusterOptions options;
    options.clusters = 30;
    const auto plain = make_clusters(surface, options);
    ASSERT_TRUE(plain);
    for (const uint32_t bucket_triangles : {100000u, 4000u}) {
        options.bucket_triangles = bucket_triangles;
        options.density.assign(surface.triangles.size(), 1.0f);
        options.density[10000] = 1e6f;  // hundreds of clusters, of one triangle
        const auto made = make_clusters(surface, options);
        ASSERT_TRUE(made);
        EXPECT_EQ(std::ranges::count(made->label, made->label[10000]), 1);
        EXPECT_GE(made->count, plain->count);
        EXPECT_LE(made->count, plain->count + 4) << bucket_triangles;
    }
}

TEST(Clusters, AreTheSameForAnyNumberOfThreadsAndAtAnyScale) {
    TriMesh mesh = generate(Shape::rock, 20000, 2);
    ASSERT_TRUE(repair(mesh));
    ClusterOptions options;
    options.clusters = 30;
    options.bucket_triangles = 3000;
    std::vector<uint32_t> first;
    for (const unsigned threads : {1u, 2u, 8u}) {
        set_thread_count(threads);
        const auto clusters = make_clusters(surface_of(mesh), options);
        ASSERT_TRUE(clusters);
        EXPECT_GT(clusters->buckets, 4u);
        if (first.empty()) first = clusters->label;
        EXPECT_EQ(clusters->label, first) << threads;
    }
    set_thread_count(0);
    for (const float scale : {0.0009765625f, 1024.0f}) {
        TriMesh scaled = mesh;
        for (glm::vec3& p : scaled.positions) p *= scale;
        EXPECT_EQ(make_clusters(surface_of(scaled), options)->label, first) << scale;
    }
}

}  // namespace
}  // namespace lodestone::vgi
