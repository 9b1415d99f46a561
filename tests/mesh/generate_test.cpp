#include "mesh/generate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <map>
#include <set>

#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "mesh/topology.h"

namespace lodestone {
namespace {

constexpr Shape all_shapes[] = {Shape::rock,  Shape::terrain, Shape::grid, Shape::sphere,
                                Shape::torus, Shape::cliff,   Shape::vase, Shape::scan};

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
        if (shape == Shape::scan) continue;  // a rock, with much paint
        for (const uint64_t triangles : {100000u, 300000u}) {
            const auto made = static_cast<double>(generate(shape, triangles, 1).triangle_count());
            EXPECT_NEAR(made / static_cast<double>(triangles), 1, 0.01) << static_cast<int>(shape);
        }
    }
}

TEST(Generate, IsTheSameForAnyNumberOfThreadsAndAnotherForAnotherSeed) {
    for (const Shape shape : {Shape::rock, Shape::terrain, Shape::cliff, Shape::scan}) {
        set_thread_count(1);
        const uint64_t triangles = shape == Shape::scan ? 4000 : 20000;
        const TriMesh one = generate(shape, triangles, 5);
        set_thread_count(8);
        const TriMesh eight = generate(shape, triangles, 5);
        set_thread_count(0);
        EXPECT_EQ(one.positions, eight.positions);
        EXPECT_EQ(one.triangles, eight.triangles);
        EXPECT_EQ(one.uvs, eight.uvs);
        for (size_t i = 0; i < one.images.size(); ++i) EXPECT_EQ(one.images[i].texels, eight.images[i].texels);
        EXPECT_NE(one.positions, generate(shape, triangles, 6).positions);
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

// Of triangles that are joined along edges of the texture.
size_t fragments_of(const TriMesh& mesh) {
    DisjointSets sets(mesh.wedge_count());
    for (const Triangle& t : mesh.triangles) {
        sets.join(t[0], t[1]);
        sets.join(t[0], t[2]);
    }
    std::set<uint32_t> roots;
    for (uint32_t w = 0; w < mesh.wedge_count(); ++w) roots.insert(sets.find(w));
    return roots.size();
}

TEST(Generate, AScanHasItsTextureInFragmentsThatShowNoSeam) {
    const TriMesh mesh = generate(Shape::scan, 12000, 4);
    EXPECT_EQ(mesh.positions, generate(Shape::rock, 12000, 4).positions);
    EXPECT_NEAR(static_cast<double>(fragments_of(mesh)), 600, 40);
    ASSERT_EQ(mesh.images.size(), 1u);
    const Image& image = mesh.images[0];
    EXPECT_EQ(image.width, 2048u);
    // Where fragments meet they have the same paint; nearest texels are a third of a texel's paint off, about.
    std::map<uint32_t, glm::vec3> seen;  // by vertex
    double differ = 0;
    size_t met = 0;
    for (uint32_t w = 0; w < mesh.wedge_count(); ++w) {
        ASSERT_TRUE(glm::all(glm::greaterThan(mesh.uvs[w], glm::vec2(0))) &&
                    glm::all(glm::lessThan(mesh.uvs[w], glm::vec2(1))));
        const glm::uvec2 texel(mesh.uvs[w] * 2048.0f);
        const glm::vec3 colour(image.texels[size_t{texel.y} * 2048 + texel.x]);
        const auto [other, is_first] = seen.emplace(mesh.wedge_vertex[w], colour);
        if (is_first) continue;
        differ += static_cast<double>(glm::distance(colour, other->second));
        ++met;
    }
    EXPECT_GT(met, 3000u);
    EXPECT_LT(differ / static_cast<double>(met), 6);
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
