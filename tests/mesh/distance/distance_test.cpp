#include "mesh/distance/distance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "base/threads.h"
#include "fixtures/meshes.h"
#include "mesh/distance/closest_point.h"
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
// Triangles that share their centre cannot be told apart by it, nor can places one rounding apart be halved.
TEST(ClosestSurface, IsBuiltWhereCentresCannotBeToldApart) {
    for (const float away : {0.0f, 20000.0f}) {
        std::vector<glm::vec3> positions;
        std::vector<uint32_t> indices;
        for (uint32_t i = 0; i < 15; ++i) {
            const float turn = 0.1f * static_cast<float>(i);
            for (uint32_t k = 0; k < 3; ++k) {
                const float angle = turn + 2.0943951f * static_cast<float>(k);
                positions.emplace_back(away + std::cos(angle) * 0.01f, std::sin(angle) * 0.01f, away);
                indices.push_back(3 * i + k);
            }
        }
        const ClosestSurface surface(positions, indices);
        EXPECT_NEAR(surface.closest({static_cast<double>(away), 0, static_cast<double>(away) + 3}).distance, 3, 1e-9);
    }
}

// A fan of needles that run askew through the whole box: boxes tell nothing of where they are.
TEST(ClosestSurface, EqualsBruteForceOnNeedles) {
    Random random(5);
    std::vector<glm::vec3> positions = {{0, 0, 0}};
    std::vector<uint32_t> indices;
    for (uint32_t i = 0; i < 2000; ++i) {
        const float t = static_cast<float>(i) * 1e-3f;
        positions.emplace_back(1 + t, 2 - t, 0.7f);
        if (i > 0) indices.insert(indices.end(), {0, i, i + 1});
    }
    const ClosestSurface surface(positions, indices);
    for (int q = 0; q < 200; ++q) {
        const glm::dvec3 p(random.uniform(0, 3), random.uniform(0, 2), random.uniform(-1, 1));
        double best = std::numeric_limits<double>::infinity();
        for (size_t t = 0; t < indices.size(); t += 3) {
            const glm::dvec3 on =
                closest_on_triangle(p, positions[indices[t]], positions[indices[t + 1]], positions[indices[t + 2]]);
            best = std::min(best, glm::distance(p, on));
        }
        EXPECT_NEAR(surface.closest(p).distance, best, 1e-12);
        EXPECT_LE(surface.closest(p, 7, 0.5).distance, std::max(best, 0.5) + 1e-12);
    }
}

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

TEST(SurfaceDistance, TheFarthestAloneIsTheSameWhateverIsKnownBefore) {
    const TriMesh a = fixtures::torus(24, 12), b = fixtures::torus(17, 9);
    const MeasuredSurface from(a, {20000}), to(b, {20000});
    const double largest = from.to(to).max;
    EXPECT_GT(largest, 0);
    for (const double known : {0.0, 0.3 * largest, largest}) EXPECT_EQ(from.farthest_from(to, known), largest);
    EXPECT_EQ(from.farthest_from(to, 2 * largest), 2 * largest);
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
