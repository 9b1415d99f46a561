#include "mesh/distance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "base/threads.h"
#include "fixtures/meshes.h"
#include "mesh/closest_point.h"
#include "mesh/generate.h"

namespace lodestone {
namespace {

glm::vec3 random_point(Random& random) { return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}; }

TEST(ClosestSurface, EqualsBruteForceOnSoupsWithDegenerateTriangles) {
    Random random(5);
    for (int round = 0; round < 20; ++round) {
        std::vector<glm::vec3> points;
        std::vector<uint32_t> indices;
        for (int i = 0; i < 40; ++i) points.push_back(random_point(random));
        for (int t = 0; t < 60; ++t) {
            for (int k = 0; k < 3; ++k) indices.push_back(random.below(40));
            if (t % 5 == 0) indices.back() = indices[indices.size() - 2];   // a segment
            if (t % 11 == 0) indices[indices.size() - 3] = indices.back();  // a point
        }
        const ClosestSurface surface(points, indices);
        for (int q = 0; q < 50; ++q) {
            const glm::dvec3 p = random_point(random) * 2.0f;
            double best = 1e9;
            for (size_t i = 0; i < indices.size(); i += 3) {
                best =
                    std::min(best, glm::distance(p, closest_on_triangle(p, points[indices[i]], points[indices[i + 1]],
                                                                        points[indices[i + 2]])));
            }
            EXPECT_NEAR(surface.closest(p).distance, best, 1e-12);
            EXPECT_NEAR(surface.closest(p, random.below(60)).distance, best, 1e-12);
        }
    }
}

// The closest point is never farther than any point of the triangle.
TEST(ClosestOnTriangle, IsNotFartherThanAnyOtherPointOfTheTriangle) {
    Random random(6);
    for (int round = 0; round < 300; ++round) {
        const glm::dvec3 a = random_point(random), b = random_point(random);
        const glm::dvec3 c = round % 3 == 0 ? a + (b - a) * random.uniform(-1, 2) : glm::dvec3(random_point(random));
        const glm::dvec3 p = random_point(random) * 2.0f;
        const double closest = glm::distance(p, closest_on_triangle(p, a, b, c));
        for (int i = 0; i < 100; ++i) {
            double u = random.unit(), v = random.unit();
            if (u + v > 1) u = 1 - u, v = 1 - v;
            EXPECT_LE(closest, glm::distance(p, a + (b - a) * u + (c - a) * v) + 1e-9);
        }
    }
}

TEST(SurfaceDistance, IsZeroToItself) {
    const TriMesh mesh = generate(Shape::rock, 2000);
    const auto d = surface_distance(mesh, mesh);
    EXPECT_LT(d.max(), 1e-7);
}

TEST(SurfaceDistance, OfAMovedPlaneIsTheMove) {
    const TriMesh a = fixtures::grid(10, 10);
    TriMesh b = fixtures::grid(7, 5);
    for (glm::vec3& p : b.positions) p.y += 0.25f;
    const auto d = surface_distance(a, b);
    EXPECT_NEAR(d.max(), 0.25, 1e-6);
    EXPECT_NEAR(d.rms(), 0.25, 1e-6);
}

TEST(SurfaceDistance, SeesWhatOnlyOneSideHas) {
    const TriMesh one = fixtures::tetrahedron(), two = fixtures::two_tetrahedra();
    const auto d = surface_distance(one, two);
    EXPECT_LT(d.a_to_b.max, 1e-6);
    EXPECT_GT(d.b_to_a.max, 3);
    EXPECT_EQ(d.max(), d.b_to_a.max);
}

TEST(SurfaceDistance, OfConcentricSpheresIsTheDifferenceOfTheirRadii) {
    const TriMesh a = generate(Shape::sphere, 30000);
    TriMesh b = a;
    for (glm::vec3& p : b.positions) p *= 1.1f;
    EXPECT_NEAR(surface_distance(a, b).rms(), 0.1, 1e-3);
}

TEST(SurfaceDistance, IsTheSameForAnyNumberOfThreads) {
    const TriMesh a = generate(Shape::rock, 3000, 1), b = generate(Shape::rock, 2000, 2);
    set_thread_count(1);
    const auto one = surface_distance(a, b);
    set_thread_count(8);
    const auto eight = surface_distance(a, b);
    set_thread_count(0);
    EXPECT_EQ(one.rms(), eight.rms());
    EXPECT_EQ(one.max(), eight.max());
}

}  // namespace
}  // namespace lodestone
