#include "mesh/generate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/threads.h"
#include "mesh/topology.h"

namespace lodestone {
namespace {

constexpr Shape all_shapes[] = {Shape::rock,  Shape::terrain, Shape::grid, Shape::sphere,
                                Shape::torus, Shape::cliff,   Shape::vase};

TEST(Generate, MakesValidMeshesWithNormalsAndTextureCoordinates) {
    for (const Shape shape : all_shapes) {
        for (const uint64_t triangles : {1u, 50u, 5000u}) {
            const TriMesh mesh = generate(shape, triangles, 3);
            ASSERT_TRUE(mesh.validate()) << mesh.validate().error().message;
            EXPECT_GT(mesh.triangle_count(), 0u);
            EXPECT_EQ(mesh.normals.size(), mesh.wedge_count());
            EXPECT_EQ(mesh.uvs.size(), mesh.wedge_count());
        }
    }
}

TEST(Generate, MeetsTheCountWithinOnePercent) {
    for (const Shape shape : all_shapes) {
        for (const uint64_t triangles : {100000u, 300000u}) {
            const auto made = static_cast<double>(generate(shape, triangles, 1).triangle_count());
            EXPECT_NEAR(made / static_cast<double>(triangles), 1, 0.01) << static_cast<int>(shape);
        }
    }
}

TEST(Generate, IsTheSameForAnyNumberOfThreadsAndAnotherForAnotherSeed) {
    for (const Shape shape : {Shape::rock, Shape::terrain, Shape::cliff}) {
        set_thread_count(1);
        const TriMesh one = generate(shape, 20000, 5);
        set_thread_count(8);
        const TriMesh eight = generate(shape, 20000, 5);
        set_thread_count(0);
        EXPECT_EQ(one.positions, eight.positions);
        EXPECT_EQ(one.triangles, eight.triangles);
        EXPECT_NE(one.positions, generate(shape, 20000, 6).positions);
    }
}

TEST(Generate, TheRockIsRoughAtTheScaleOfItsTriangles) {
    const TriMesh mesh = generate(Shape::rock, 50000, 7);
    double bend = 0;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const glm::vec3 face = glm::normalize(glm::cross(mesh.position_of(t, 1) - mesh.position_of(t, 0),
                                                         mesh.position_of(t, 2) - mesh.position_of(t, 0)));
        bend += 1 - static_cast<double>(glm::dot(face, mesh.normals[mesh.triangles[t][0]]));
    }
    EXPECT_GT(bend / static_cast<double>(mesh.triangle_count()), 0.002);
}

TEST(Generate, ASphereFacesOutwards) {
    const TriMesh mesh = generate(Shape::sphere, 3000);
    for (size_t w = 0; w < mesh.wedge_count(); ++w)
        EXPECT_GT(glm::dot(mesh.normals[w], mesh.positions[mesh.wedge_vertex[w]]), 0.9f);
}

TEST(Generate, AVaseIsOneClosedSurfaceWithATextureAndACliffHangsOver) {
    const TriMesh vase = generate(Shape::vase, 8000);
    const Topology topology = topology_of(vase);
    EXPECT_TRUE(topology.manifold());
    EXPECT_EQ(topology.components, 1u);
    EXPECT_EQ(topology.boundary_loops, 0u);
    EXPECT_EQ(topology.genus, 1);
    ASSERT_EQ(vase.images.size(), 1u);
    EXPECT_EQ(vase.material_table[0].base_colour_texture.image, 0);
    const TriMesh cliff = generate(Shape::cliff, 50000);
    const auto hangs = [&](const glm::vec3& normal) { return normal.y < -0.05f; };
    EXPECT_GT(std::count_if(cliff.normals.begin(), cliff.normals.end(), hangs), 100);
}

TEST(ShapeNamed, RefusesAnUnknownShapeByNamingTheChoices) {
    EXPECT_EQ(*shape_named("torus"), Shape::torus);
    EXPECT_NE(shape_named("teapot").error().message.find("choose from rock"), std::string::npos);
}

}  // namespace
}  // namespace lodestone
