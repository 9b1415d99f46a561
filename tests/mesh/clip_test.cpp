// Pieces of a mesh fit: each keeps its side, and both have the same vertices where they meet.
#include "mesh/clip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <map>
#include <set>

#include "fixtures/meshes.h"
#include "mesh/generate.h"
#include "mesh/topology.h"

namespace lodestone {
namespace {

using Place = std::array<float, 3>;

TriMesh piece_of(TriMesh mesh, const std::vector<ClipPlane>& planes) {
    const auto done = clip(mesh, planes);
    EXPECT_TRUE(done) << done.error().message;
    const auto valid = mesh.validate();
    EXPECT_TRUE(valid) << valid.error().message;
    return mesh;
}

double area_of(const TriMesh& mesh) {
    double area = 0;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const glm::dvec3 a(mesh.position_of(t, 0)), b(mesh.position_of(t, 1)), c(mesh.position_of(t, 2));
        area += glm::length(glm::cross(b - a, c - a)) / 2;
    }
    return area;
}

// Net times that edges between places are run through, one way less the other; those of 0 are left out.
using Edges = std::map<std::pair<Place, Place>, int>;
void add_edges(const TriMesh& mesh, Edges& edges) {
    const auto place = [&](size_t t, int k) {
        const glm::vec3& p = mesh.position_of(t, k % 3);
        return Place{p.x, p.y, p.z};
    };
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        for (int k = 0; k < 3; ++k) {
            const Place a = place(t, k), b = place(t, k + 1);
            if (a == b) continue;
            if ((edges[std::minmax(a, b)] += a < b ? 1 : -1) == 0) edges.erase(std::minmax(a, b));
        }
    }
}

constexpr glm::dvec3 slanted{0.6, 0, 0.8};

TEST(Clip, PiecesOfAClosedMeshAreClosedTogether) {
    const TriMesh rock = fixtures::repaired(Shape::rock, 3000);
    for (const glm::dvec3& normal : {glm::dvec3(1, 0, 0), slanted}) {
        Edges edges;
        double area = 0;
        for (const bool above : {false, true}) {
            const std::vector<ClipPlane> planes = {{normal, 0.0625, above}};
            const TriMesh piece = piece_of(rock, planes);
            EXPECT_LT(piece.triangle_count(), rock.triangle_count());
            for (const glm::vec3& p : piece.positions)
                EXPECT_GE(planes[0].height(p) * (above ? 1 : -1), -1e-7) << "nothing is beyond the plane";
            EXPECT_FALSE(topology_of(piece).closed());
            add_edges(piece, edges);
            area += area_of(piece);
        }
        EXPECT_TRUE(edges.empty());
        EXPECT_NEAR(area, area_of(rock), 1e-5 * area);
    }
}

// Large triangles that several planes cut, in pieces that are not cut by all of the same planes.
TEST(Clip, PiecesOfAGridOfPlanesFitWhateverElseCutsThem) {
    const TriMesh rock = fixtures::repaired(Shape::rock, 60);
    const ClipPlane west{{1, 0, 0}, -0.25, false}, middle{{1, 0, 0}, 0.25, false}, line{slanted, 0.125, false};
    const auto other = [](ClipPlane plane) {
        plane.above = true;
        return plane;
    };
    Edges edges;
    for (const ClipPlane& side : {line, other(line)}) {
        for (const std::vector<ClipPlane>& strip :
             {std::vector{west}, std::vector{other(west), middle}, std::vector{other(middle)}}) {
            std::vector<ClipPlane> planes = strip;
            planes.insert(planes.begin(), side);
            add_edges(piece_of(rock, planes), edges);
        }
    }
    EXPECT_TRUE(edges.empty()) << edges.size();
}

TEST(Clip, AttributesAreThoseOfThePlace) {
    TriMesh mesh = fixtures::bumpy_grid(8, 8);
    mesh.normals.clear();
    mesh.uvs.clear();
    for (const glm::vec3& p : mesh.positions) {
        mesh.uvs.emplace_back(2 * p.x + p.z, p.y);
        mesh.second_uvs.emplace_back(p.z, p.x - p.y);
        mesh.normals.emplace_back(0, 1, 0);
        mesh.tangents.emplace_back(glm::normalize(glm::vec3(1 + p.x * p.x, 0, p.z)), -1);
        mesh.colours.emplace_back(10, 20, 30, 255);
    }
    const TriMesh piece = piece_of(mesh, {{slanted, 0.3, true}});
    ASSERT_TRUE(piece.validate());
    ASSERT_EQ(piece.uvs.size(), piece.wedge_count());
    ASSERT_EQ(piece.second_uvs.size(), piece.wedge_count());
    size_t fresh = 0;
    for (size_t w = 0; w < piece.wedge_count(); ++w) {
        const glm::vec3& p = piece.positions[piece.wedge_vertex[w]];
        EXPECT_NEAR(piece.uvs[w].x, 2 * p.x + p.z, 1e-5f);
        EXPECT_NEAR(piece.uvs[w].y, p.y, 1e-5f);
        EXPECT_NEAR(piece.second_uvs[w].x, p.z, 1e-5f);
        EXPECT_NEAR(piece.second_uvs[w].y, p.x - p.y, 1e-5f);
        EXPECT_EQ(piece.normals[w], glm::vec3(0, 1, 0));
        EXPECT_GT(glm::dot(glm::vec3(piece.tangents[w]), glm::normalize(glm::vec3(1 + p.x * p.x, 0, p.z))), 0.99f);
        EXPECT_EQ(piece.tangents[w].w, -1);
        EXPECT_EQ(piece.colours[w], glm::u8vec4(10, 20, 30, 255));
        fresh += lies_on({slanted, 0.3, true}, p, p, 10) ? 1 : 0;
    }
    EXPECT_GT(fresh, 8u);
}

// Where one end has no tangent, or that of a mirrored frame, nothing lies between.
TEST(Clip, BetweenTangentsOfUnlikeFramesIsOneOfThem) {
    TriMesh mesh = fixtures::bumpy_grid(8, 8);
    mesh.normals.assign(mesh.wedge_count(), glm::vec3(0, 1, 0));
    const std::array<glm::vec4, 3> kinds{glm::vec4(0), glm::vec4(1, 0, 0, 1), glm::vec4(0, 0, 1, -1)};
    for (size_t w = 0; w < mesh.wedge_count(); ++w) mesh.tangents.push_back(kinds[w % 3]);
    const TriMesh piece = piece_of(mesh, {{slanted, 0.3, true}});
    ASSERT_TRUE(piece.validate()) << piece.validate().error().message;
    for (const glm::vec4& tangent : piece.tangents) EXPECT_EQ(std::ranges::count(kinds, tangent), 1);
}

TEST(Clip, WhatLiesInThePlaneIsBelow) {
    TriMesh mesh;
    mesh.positions = {{0, 1, 0}, {1, 1, 0}, {0, 1, 1}};
    mesh.triangles = {{0, 2, 1}};
    mesh.set_identity_wedges();
    EXPECT_EQ(piece_of(mesh, {{{0, 1, 0}, 1, false}}).triangle_count(), 1u);
    const auto above = clip(mesh, std::vector<ClipPlane>{{{0, 1, 0}, 1, true}});
    ASSERT_FALSE(above);
    EXPECT_EQ(above.error().fault, Fault::format);
}

}  // namespace
}  // namespace lodestone
