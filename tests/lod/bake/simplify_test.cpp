#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <glm/geometric.hpp>

#include "fixtures/meshes.h"
#include "fixtures/real_data.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/io/read.h"
#include "mesh/repair.h"
#include "mesh/topology.h"

namespace lodestone {
namespace {

TEST(OpenMeshSimplifier, MakesValidListsForEveryMesh) {
    for (const auto& f : fixtures::manifold_meshes()) {
        SCOPED_TRACE(f.name);
        const auto list = make_openmesh_simplifier()->simplify(f.mesh, {});
        ASSERT_TRUE(list) << list.error().message;
        if (f.mesh.triangle_count() > 12) { EXPECT_FALSE(list->collapses.empty()); }
        const auto valid = list->validate(f.mesh);
        EXPECT_TRUE(valid) << valid.error().message;
    }
}

// Faces of a cube with a normal per face: every edge is a seam of normals, and yet it must simplify.
TEST(QuadricSimplifier, ClosesSeamsOfNormalsButNotOfTextures) {
    enum Textured { nowhere, on_first_set, on_second_set };
    const auto faceted = [](Textured textured) {
        TriMesh mesh = generate(Shape::sphere, 2000, 1);
        EXPECT_TRUE(repair(mesh));
        TriMesh out;
        out.positions = mesh.positions;
        for (size_t t = 0; t < mesh.triangle_count(); ++t) {
            const glm::vec3 a = mesh.position_of(t, 0),
                            n = glm::normalize(glm::cross(mesh.position_of(t, 1) - a, mesh.position_of(t, 2) - a));
            Triangle corners{};
            for (int k = 0; k < 3; ++k) {
                corners[static_cast<size_t>(k)] = static_cast<uint32_t>(out.wedge_vertex.size());
                out.wedge_vertex.push_back(mesh.vertex_of(t, k));
                out.normals.push_back(n);
                const glm::vec2 own(static_cast<float>(t), static_cast<float>(k));
                if (textured != nowhere) out.uvs.push_back(textured == on_first_set ? own : glm::vec2(0));
                if (textured == on_second_set) out.second_uvs.push_back(own);
            }
            out.triangles.push_back(corners);
        }
        return out;
    };
    const TriMesh soft = faceted(nowhere);
    const auto closing = make_quadric_simplifier()->simplify(soft, {});
    ASSERT_TRUE(closing);
    EXPECT_TRUE(closing->validate(soft)) << closing->validate(soft).error().message;
    EXPECT_GT(closing->collapses.size(), soft.vertex_count() / 2);
    for (const Textured textured : {on_first_set, on_second_set}) {
        const auto kept = make_quadric_simplifier()->simplify(faceted(textured), {});
        ASSERT_TRUE(kept);
        EXPECT_EQ(kept->collapses.size(), 0u);
    }
}

// A vertex may have two wedges that nothing tells apart: of normals that count for nothing, or without attributes.
TEST(QuadricSimplifier, ClosesSeamsThatNoAttributeTellsApart) {
    const TriMesh torus = fixtures::torus(24, 12);
    TriMesh mesh;
    mesh.positions = torus.positions;
    mesh.triangles = torus.triangles;
    mesh.wedge_vertex = torus.wedge_vertex;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        mesh.wedge_vertex.push_back(mesh.wedge_vertex[mesh.triangles[t][0]]);
        mesh.triangles[t][0] = static_cast<uint32_t>(mesh.wedge_vertex.size() - 1);
    }
    TriMesh normals = mesh;
    compute_normals(normals);
    SimplifyOptions weightless;
    weightless.normal_weight = 0;
    for (const auto& [given, options] : {std::pair(mesh, SimplifyOptions{}), std::pair(normals, weightless)}) {
        const auto list = make_quadric_simplifier()->simplify(given, options);
        ASSERT_TRUE(list);
        const auto valid = list->validate(given);
        EXPECT_TRUE(valid) << valid.error().message;
        EXPECT_GT(list->collapses.size(), given.vertex_count() / 2);
    }
}

TEST(QuadricSimplifier, IsTheSameAtEveryScaleAndPlace) {
    TriMesh mesh = generate(Shape::rock, 2000, 3);
    ASSERT_TRUE(repair(mesh));
    TriMesh large = mesh;
    for (glm::vec3& p : large.positions) p *= 1024.0f;
    const auto a = make_quadric_simplifier()->simplify(mesh, {}), b = make_quadric_simplifier()->simplify(large, {});
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->collapses.size(), b->collapses.size());
    for (size_t i = 0; i < a->collapses.size(); ++i) ASSERT_EQ(a->collapses[i].removed, b->collapses[i].removed);
}

// A closed spindle of two hubs: every vertex but them has four neighbours, they have thousands.
TEST(QuadricSimplifier, TakesHubsOfThousandsOfTriangles) {
    constexpr uint32_t around = 3000;
    TriMesh spindle;
    spindle.positions = {{0, 0, 4}, {0, 0, -4}};
    for (uint32_t i = 0; i < around; ++i) {
        const double angle = 6.283185307179586 * i / around;
        spindle.positions.emplace_back(std::cos(angle), std::sin(angle), 0.01 * (i % 3));
        const uint32_t a = 2 + i, b = 2 + (i + 1) % around;
        spindle.triangles.push_back({0, a, b});
        spindle.triangles.push_back({1, b, a});
    }
    spindle.set_identity_wedges();
    const auto list = make_quadric_simplifier()->simplify(spindle, {});
    ASSERT_TRUE(list);
    const auto valid = list->validate(spindle);
    EXPECT_TRUE(valid) << valid.error().message;
    EXPECT_LT(spindle.triangle_count() - 2 * list->collapses.size(), 200u);
    auto pm = bake_progressive_mesh(spindle, *list, {"keyframe"});
    ASSERT_TRUE(pm) << pm.error().message;
    EXPECT_TRUE(pm->validate());
}

TEST(QuadricSimplifier, StopsAtTheTarget) {
    const TriMesh mesh = fixtures::torus(24, 12);
    SimplifyOptions options;
    options.target_triangles = 200;
    const auto list = make_quadric_simplifier()->simplify(mesh, options);
    ASSERT_TRUE(list);
    EXPECT_EQ(list->stop, StopReason::target_reached);
    EXPECT_LE(mesh.triangle_count() - 2 * list->collapses.size(), 200u);
}

// The seed's demand on real meshes: a bake whose orders play down and up to the same slots, and whose levels stay the
// surface they were.
class RealMesh : public testing::TestWithParam<const char*> {};

TEST_P(RealMesh, PlaysDownAndUpSlotForSlotAndKeepsItsSurface) {
    if (!fixtures::real_data(GetParam())) GTEST_SKIP() << fixtures::missing_data_note(GetParam());
    const auto mesh = fixtures::repaired_real_mesh(GetParam());
    ASSERT_TRUE(mesh) << mesh.error().message;
    const Topology before = topology_of(*mesh);
    const auto list = make_quadric_simplifier()->simplify(*mesh, {});
    ASSERT_TRUE(list);
    const auto valid = list->validate(*mesh);
    EXPECT_TRUE(valid) << valid.error().message;
    auto pm = bake_progressive_mesh(*mesh, *list, {"static", "classic"});
    ASSERT_TRUE(pm) << pm.error().message;
    const auto sound = pm->validate();  // plays every order down and up
    EXPECT_TRUE(sound) << sound.error().message;
    for (uint32_t step = 0; step <= 10; ++step) {
        const TriMesh level = *extract_level(*pm, (pm->levels() - 1) * step / 10);
        const Topology after = topology_of(level);
        EXPECT_EQ(after.components, before.components);
        EXPECT_EQ(after.boundary_loops, before.boundary_loops);
        EXPECT_EQ(after.non_manifold_edges + after.non_manifold_vertices + after.inconsistent_edges, 0u);
        EXPECT_EQ(after.genus, before.genus);
    }
}

INSTANTIATE_TEST_SUITE_P(Scans, RealMesh,
                         testing::Values("scans/stanford-bunny.obj", "scans/horse.ply", "scans/rockerArm.ply",
                                         "scans/laurana.ply", "scans/falconstatue_boundary.obj", "nasty/cow.off",
                                         "nasty/cheese.off", "nasty/moebius.obj", "nasty/mite.obj", "nasty/pig.stl",
                                         "nasty/camel_b.obj", "nasty/112932.stl",
                                         "nasty/Generic_Twin_7081.1.t0_left.obj",
                                         "gltf/DamagedHelmet/DamagedHelmet.glb"),
                         [](const auto& test) { return fixtures::test_name_of(test.param); });

}  // namespace
}  // namespace lodestone
