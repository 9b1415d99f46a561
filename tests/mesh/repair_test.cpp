#include "mesh/repair.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/topology.h"

namespace lodestone {
namespace {

TriMesh soup(std::vector<glm::vec3> positions, std::vector<Triangle> triangles) {
    TriMesh mesh;
    mesh.positions = std::move(positions);
    mesh.triangles = std::move(triangles);
    mesh.set_identity_wedges();
    return mesh;
}

// Every triangle with three vertices of its own.
TriMesh torn_apart(const TriMesh& mesh) {
    TriMesh torn;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const auto first = static_cast<uint32_t>(torn.positions.size());
        for (int k = 0; k < 3; ++k) torn.positions.push_back(mesh.position_of(t, k));
        torn.triangles.push_back({first, first + 1, first + 2});
    }
    torn.set_identity_wedges();
    return torn;
}

RepairReport repaired(TriMesh& mesh, const RepairOptions& options = {}) {
    const auto report = repair(mesh, options);
    EXPECT_TRUE(report) << report.error().message;
    EXPECT_TRUE(mesh.validate()) << mesh.validate().error().message;
    const Topology t = topology_of(mesh);
    EXPECT_EQ(t.non_manifold_edges, 0u);
    EXPECT_EQ(t.non_manifold_vertices, 0u);
    EXPECT_EQ(t.inconsistent_edges, 0u);
    return *report;
}

double signed_volume(const TriMesh& mesh) {
    double sum = 0;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const glm::dvec3 a(mesh.position_of(t, 0)), b(mesh.position_of(t, 1)), c(mesh.position_of(t, 2));
        sum += glm::dot(a, glm::cross(b, c));
    }
    return sum / 6;
}

TEST(Repair, LeavesCleanMeshesAlone) {
    for (const auto& f : fixtures::manifold_meshes()) {
        SCOPED_TRACE(f.name);
        TriMesh mesh = f.mesh;
        EXPECT_FALSE(repaired(mesh).changed());
        EXPECT_EQ(mesh.triangles, f.mesh.triangles);
        EXPECT_EQ(mesh.positions, f.mesh.positions);
    }
}

TEST(Repair, EndsWhereItIsStopped) {
    TriMesh mesh = fixtures::manifold_meshes().front().mesh;
    const std::atomic<bool> stop = true;
    Progress progress;
    progress.stop = &stop;
    const auto stopped = repair(mesh, {}, progress);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().fault, Fault::interrupted);
}

TEST(Repair, WeldsASoupBackIntoTheMeshItWas) {
    for (const auto& f : fixtures::manifold_meshes()) {
        SCOPED_TRACE(f.name);
        TriMesh mesh = torn_apart(f.mesh);
        const RepairReport report = repaired(mesh);
        EXPECT_EQ(report.welded_vertices, 3 * f.mesh.triangle_count() - f.mesh.vertex_count());
        const Topology before = topology_of(f.mesh), after = topology_of(mesh);
        EXPECT_EQ(after.vertices, before.vertices);
        EXPECT_EQ(after.boundary_loops, before.boundary_loops);
        EXPECT_EQ(after.genus, before.genus);
    }
}

// The hub of a wheel of triangles has as many wedges as spokes before they are welded.
TEST(Repair, LeavesOneWedgePerKindHoweverManyTrianglesMeet) {
    for (const uint32_t kinds : {1u, 2u, 300u}) {
        TriMesh wheel;
        constexpr uint32_t spokes = 600;
        for (uint32_t i = 0; i < spokes; ++i) {
            const auto rim = [&](uint32_t k) {
                const double angle = 6.283185307179586 * (k % spokes) / spokes;
                return glm::vec3(std::cos(angle), std::sin(angle), 0);
            };
            for (const glm::vec3& p : {glm::vec3(0), rim(i), rim(i + 1)}) {
                wheel.positions.push_back(p);
                wheel.uvs.emplace_back(static_cast<float>(i % kinds), 0.0f);
            }
            wheel.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
        }
        wheel.set_identity_wedges();
        ASSERT_TRUE(repair(wheel));
        EXPECT_EQ(wheel.vertex_count(), spokes + 1);
        EXPECT_EQ(wheel.wedge_count(), kinds + spokes * std::min(kinds, 2u));
    }
}

TEST(Repair, KeepsSeamsWhereAttributesDiffer) {
    TriMesh mesh = fixtures::cube_with_seams();
    TriMesh torn = mesh;
    // A vertex per wedge, as files store it.
    torn.positions.clear();
    for (const uint32_t v : mesh.wedge_vertex) torn.positions.push_back(mesh.positions[v]);
    torn.set_identity_wedges();
    repaired(torn);
    EXPECT_EQ(torn.vertex_count(), 8u);
    EXPECT_EQ(torn.wedge_count(), 24u);
    EXPECT_EQ(topology_of(torn).seam_edges, topology_of(mesh).seam_edges);
}

TEST(Repair, KeepsSeamsOfSecondTextureCoordinatesAlone) {
    TriMesh mesh = fixtures::cube_with_seams();
    mesh.normals.clear();
    mesh.second_uvs = mesh.uvs;
    mesh.uvs.assign(mesh.wedge_count(), glm::vec2(0));
    repaired(mesh);
    ASSERT_TRUE(mesh.validate());
    EXPECT_EQ(mesh.vertex_count(), 8u);
    EXPECT_GT(topology_of(mesh).seam_edges, 0u);
    const size_t wedges = mesh.wedge_count();
    // Where they agree, nothing tells the wedges apart.
    mesh.second_uvs.assign(mesh.wedge_count(), glm::vec2(0));
    repaired(mesh);
    EXPECT_LT(mesh.wedge_count(), wedges);
    EXPECT_EQ(mesh.wedge_count(), 8u);
}

TEST(TriMesh, SecondTextureCoordinatesAreOnePerWedgeAndBehindFirstOnes) {
    TriMesh mesh = fixtures::cube_with_seams();
    mesh.second_uvs = mesh.uvs;
    EXPECT_TRUE(mesh.validate());
    mesh.second_uvs.pop_back();
    EXPECT_FALSE(mesh.validate());
    mesh.second_uvs = mesh.uvs;
    mesh.uvs.clear();
    EXPECT_FALSE(mesh.validate());
}

TEST(Repair, KeepsSeamsOfTangentsAlone) {
    TriMesh mesh = fixtures::cube_with_seams();
    mesh.uvs.clear();
    for (size_t w = 0; w < mesh.wedge_count(); ++w) {
        const glm::vec3 n = mesh.normals[w];
        mesh.tangents.emplace_back(n.y, n.z, n.x, 1);
    }
    mesh.normals.assign(mesh.wedge_count(), glm::vec3(0, 0, 1));
    ASSERT_TRUE(mesh.validate());
    repaired(mesh);
    ASSERT_TRUE(mesh.validate());
    EXPECT_EQ(mesh.wedge_count(), 24u);
    // Frames that are mirrored, and those that are none, are others.
    for (glm::vec4& t : mesh.tangents)
        t = t.x > 0 ? glm::vec4(1, 0, 0, 1) : t.x < 0 ? glm::vec4(1, 0, 0, -1) : glm::vec4(0);
    repaired(mesh);
    EXPECT_EQ(mesh.wedge_count(), 16u) << "one of a y side, one of both others, at every corner";
    mesh.tangents.assign(mesh.wedge_count(), glm::vec4(1, 0, 0, 1));
    repaired(mesh);
    EXPECT_EQ(mesh.wedge_count(), 8u);
}

TEST(TriMesh, TangentsAreUnitVectorsWithASignBesideNormals) {
    TriMesh mesh = fixtures::cube_with_seams();
    const auto said = [&](const glm::vec4& tangent) {
        mesh.tangents.assign(mesh.wedge_count(), glm::vec4(0));
        mesh.tangents[5] = tangent;
        const auto valid = mesh.validate();
        return valid ? "" : valid.error().message;
    };
    EXPECT_EQ(said({0, 0.6f, -0.8f, -1}), "");
    EXPECT_EQ(said({0, 0, 0, 0}), "");
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const glm::vec4& wrong : {glm::vec4(1, 0, 0, 0), glm::vec4(1, 0, 0, 0.5f), glm::vec4(2, 0, 0, 1),
                                   glm::vec4(0, 0, 0, 1), glm::vec4(nan, 0, 0, 1), glm::vec4(1, 0, 0, nan)})
        EXPECT_EQ(said(wrong), "mesh: the tangent of wedge 5 is none");
    EXPECT_EQ(said({1, 0, 0, 1}), "");
    mesh.tangents.pop_back();
    EXPECT_FALSE(mesh.validate());
    mesh.tangents.clear();
    mesh.tangents.assign(mesh.wedge_count(), glm::vec4(1, 0, 0, 1));
    mesh.normals.clear();
    EXPECT_FALSE(mesh.validate());
}

TEST(Repair, TreatsMinusZeroAsZeroAndWeldsNearVerticesWhenAsked) {
    TriMesh mesh =
        soup({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0f, 0, 0}, {0, 1, 0}, {-1, 0, 0}}, {{0, 1, 2}, {3, 4, 5}});
    EXPECT_EQ(repaired(mesh).welded_vertices, 2u);
    TriMesh near =
        soup({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.0005f, 0, 0}, {0, 1.0004f, 0}, {-1, 0, 0}}, {{0, 1, 2}, {3, 4, 5}});
    RepairOptions options;
    EXPECT_EQ(repaired(near, options).welded_vertices, 0u);
    options.weld_distance = 0.001f;
    EXPECT_EQ(repaired(near, options).welded_vertices, 2u);
}

TEST(Repair, DropsDegenerateAndDuplicateTriangles) {
    TriMesh mesh =
        soup({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 1, 2}, {2, 1, 0}, {2, 0, 1}, {2, 1, 3}});
    const RepairReport report = repaired(mesh);
    EXPECT_EQ(report.degenerate_triangles, 1u);
    EXPECT_EQ(report.duplicate_triangles, 2u);
    EXPECT_EQ(mesh.triangle_count(), 2u);
}

TEST(Repair, TurnsAShuffledSphereOutwards) {
    TriMesh mesh = fixtures::octahedron();
    Random random(3);
    for (Triangle& t : mesh.triangles) {
        if (random.below(2) != 0) std::swap(t[0], t[1]);
    }
    repaired(mesh);
    EXPECT_GT(signed_volume(mesh), 0);
    TriMesh inside_out = fixtures::octahedron();
    for (Triangle& t : inside_out.triangles) std::swap(t[0], t[1]);
    EXPECT_EQ(repaired(inside_out).flipped_triangles, 8u);
    EXPECT_GT(signed_volume(inside_out), 0);
}

TEST(Repair, CutsAMoebiusStripOnce) {
    std::vector<glm::vec3> positions;
    std::vector<Triangle> triangles;
    constexpr uint32_t n = 20;
    for (uint32_t i = 0; i < n; ++i) {
        const float a = 6.2831853f * static_cast<float>(i) / n, half = a / 2;
        for (const float s : {-0.3f, 0.3f})
            positions.emplace_back((1 + s * std::cos(half)) * std::cos(a), (1 + s * std::cos(half)) * std::sin(a),
                                   s * std::sin(half));
    }
    for (uint32_t i = 0; i < n; ++i) {
        const uint32_t a = 2 * i, b = a + 1;
        // The ends meet the other way round.
        const uint32_t c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
        triangles.push_back({a, c, b});
        triangles.push_back({b, c, d});
    }
    TriMesh mesh = soup(positions, triangles);
    const RepairReport report = repaired(mesh);
    EXPECT_EQ(report.non_orientable_edges, 1u);
    EXPECT_EQ(topology_of(mesh).boundary_loops, 1u);
    EXPECT_EQ(topology_of(mesh).components, 1u);
}

TEST(Repair, CutsAFanOfThreeTrianglesOnAnEdge) {
    TriMesh mesh = soup({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
    const RepairReport report = repaired(mesh);
    EXPECT_EQ(report.non_manifold_edges, 1u);
    EXPECT_EQ(mesh.triangle_count(), 3u);
}

TEST(Repair, LeavesTwoSolidsThatTouchAlongAnEdgeClosed) {
    // Two tetrahedra on both sides of the edge 0-1.
    TriMesh mesh =
        soup({{0, 0, 0}, {0, 0, 1}, {1, 0.2f, 0.5f}, {1, -0.2f, 0.5f}, {-1, 0.2f, 0.5f}, {-1, -0.2f, 0.5f}}, {});
    const auto add_outwards = [&](std::array<uint32_t, 4> v) {
        glm::vec3 centre(0);
        for (const uint32_t i : v) centre += mesh.positions[i] * 0.25f;
        for (size_t skip = 0; skip < 4; ++skip) {
            Triangle t{};
            size_t k = 0;
            for (size_t i = 0; i < 4; ++i) {
                if (i != skip) t[k++] = v[i];
            }
            const glm::vec3 a = mesh.positions[t[0]],
                            n = glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
            if (glm::dot(n, a - centre) < 0) std::swap(t[1], t[2]);
            mesh.triangles.push_back(t);
        }
    };
    add_outwards({0, 1, 2, 3});
    add_outwards({0, 1, 4, 5});
    const RepairReport report = repaired(mesh);
    EXPECT_EQ(report.non_manifold_edges, 1u);
    const Topology t = topology_of(mesh);
    EXPECT_TRUE(t.closed());
    EXPECT_EQ(t.components, 2u);
}

TEST(Repair, SplitsABowTie) {
    TriMesh mesh = soup({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 3, 4}});
    EXPECT_EQ(repaired(mesh).non_manifold_vertices, 1u);
    EXPECT_EQ(mesh.vertex_count(), 6u);
}

TEST(Repair, RefusesAMeshOfNothingButDegenerateTriangles) {
    TriMesh mesh = soup({{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}});
    const auto report = repair(mesh);
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().fault, Fault::format);
}

TEST(Repair, MakesAManifoldOfRandomSoup) {
    for (uint64_t seed = 1; seed <= 200; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        std::vector<glm::vec3> positions;
        for (int i = 0; i < 12; ++i) positions.emplace_back(random.unit(), random.unit(), random.unit());
        std::vector<Triangle> triangles;
        for (int i = 0; i < 40; ++i)
            triangles.push_back({static_cast<uint32_t>(random.below(12)), static_cast<uint32_t>(random.below(12)),
                                 static_cast<uint32_t>(random.below(12))});
        TriMesh mesh = soup(positions, triangles);
        repaired(mesh);
        TriMesh again = mesh;
        RepairOptions cut_apart;
        cut_apart.weld = false;  // what was cut lies in one place and would be joined again
        const RepairReport second = repaired(again, cut_apart);
        EXPECT_EQ(second.non_manifold_edges + second.non_manifold_vertices + second.non_orientable_edges, 0u);
    }
}

}  // namespace
}  // namespace lodestone
