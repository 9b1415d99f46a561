#include "vgi/bake/charts/merged_pieces.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <set>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/generate.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

// Half of a rock, with an edge around it.
struct HalfRock {
    TriMesh mesh = fixtures::repaired(Shape::rock, 2000);
    Surface surface = surface_of(mesh);
    ChartMesh patch = take_chart_mesh(surface, first_half());

    std::vector<uint32_t> first_half() const {
        std::vector<uint32_t> half;
        for (uint32_t t = 0; t < surface.triangles.size(); ++t) {
            if (surface.positions[surface.triangles[t].vertices[0]].x > 0) half.push_back(t);
        }
        return half;
    }
    glm::dvec3 corner(uint32_t source, uint32_t k) const {
        return mesh.positions[mesh.wedge_vertex[mesh.triangles[source][k]]];
    }
};

// By source triangle, the area of its pieces.
std::map<uint32_t, double> areas(const ChartMesh& patch) {
    std::map<uint32_t, double> sum;
    for (uint32_t t = 0; t < patch.triangles.size(); ++t) sum[patch.triangles[t].source] += patch.area(t);
    return sum;
}
std::set<std::array<double, 3>> rim_of(const ChartMesh& patch) {
    std::set<std::array<double, 3>> points;
    const auto rim = patch.on_boundary();
    for (size_t v = 0; v < rim.size(); ++v) {
        const glm::dvec3& p = patch.positions[v];
        if (rim[v]) points.insert({p.x, p.y, p.z});
    }
    return points;
}

void expect_same_surface(const HalfRock& rock, const ChartMesh& cut) {
    const ChartMesh& patch = rock.patch;
    bool manifold = true;
    EXPECT_EQ(patch.twin, twins_of(patch.triangles, patch.positions.size(), &manifold));
    EXPECT_TRUE(manifold);
    EXPECT_EQ(rim_of(patch), rim_of(cut)) << "the boundary stays";
    const auto were = areas(cut), are = areas(patch);
    ASSERT_EQ(were.size(), are.size());
    for (const auto& [source, area] : were) EXPECT_NEAR(are.at(source), area, 1e-5 * area) << source;
    for (const SurfaceTriangle& t : patch.triangles) {
        const auto& place = patch.places.of(t);
        const glm::dvec3 a = rock.corner(t.source, 0), b = rock.corner(t.source, 1), c = rock.corner(t.source, 2);
        for (uint32_t k = 0; k < 3; ++k) {
            const glm::dvec3 at = a + (b - a) * double{place[k].x} + (c - a) * double{place[k].y};
            EXPECT_LT(glm::distance(at, patch.positions[t.vertices[k]]), 1e-6);
        }
        const glm::vec2 e = place[1] - place[0], f = place[2] - place[0];
        EXPECT_GT(e.x * f.y - e.y * f.x, 0) << "no piece is turned over";
    }
}

TEST(MergedPieces, WhatCutsLeftBehindIsOneTriangleAgain) {
    HalfRock rock;
    const size_t triangles = rock.patch.triangles.size(), vertices = rock.patch.positions.size();
    Random random(1);
    size_t on_rim = 0;
    for (int i = 0; i < 3000; ++i) {
        if (i % 10 == 0) {
            rock.patch.split_triangle(random.below(static_cast<uint32_t>(rock.patch.triangles.size())));
            continue;
        }
        const uint32_t h = random.below(static_cast<uint32_t>(rock.patch.twin.size()));
        on_rim += rock.patch.twin[h] == none ? 1 : 0;
        rock.patch.split_edge(h, random.uniform(0.2, 0.8), 0.5);
    }
    const ChartMesh cut = rock.patch;
    EXPECT_EQ(cut.positions.size(), vertices + 3000);
    const uint32_t taken = merge_pieces(rock.patch, rock.surface.uncut);
    EXPECT_EQ(rock.patch.positions.size() + taken, cut.positions.size());
    EXPECT_EQ(rock.patch.triangles.size() + 2 * taken, cut.triangles.size());
    expect_same_surface(rock, cut);
    // A little is in the way of itself, and triangles at the rim have its vertices.
    EXPECT_GT(taken, 2900 - on_rim);
    EXPECT_LT(rock.patch.triangles.size(), triangles + on_rim + 250);
    EXPECT_EQ(merge_pieces(rock.patch, none), 0u) << "what was there before is left alone";
}

TEST(MergedPieces, VerticesThatWereThereBeforeCutsStay) {
    // As cuts that were put back into the surface have it: all vertices have numbers there.
    HalfRock rock;
    Random random(2);
    for (int i = 0; i < 500; ++i)
        rock.patch.split_edge(random.below(static_cast<uint32_t>(rock.patch.twin.size())), random.uniform(0.2, 0.8),
                              0.5);
    const auto made = static_cast<uint32_t>(rock.surface.positions.size());
    for (size_t v = 0, next = made; v < rock.patch.origin.size(); ++v) {
        if (rock.patch.origin[v] == none) rock.patch.origin[v] = static_cast<uint32_t>(next++);
    }
    const ChartMesh cut = rock.patch;
    ChartMesh kept = cut;
    EXPECT_EQ(merge_pieces(kept, none), 0u);
    EXPECT_GT(merge_pieces(rock.patch, made), 300u);
    expect_same_surface(rock, cut);
    std::set<uint32_t> there(rock.patch.origin.begin(), rock.patch.origin.end());
    for (const uint32_t v : cut.origin) EXPECT_TRUE(v >= made || there.contains(v)) << v;
    // No two vertices of the boundary are joined that were not before.
    const auto chords = [](const ChartMesh& patch) {
        const auto rim = patch.on_boundary();
        size_t count = 0;
        for (uint32_t h = 0; h < patch.twin.size(); ++h)
            count += patch.twin[h] != none && rim[patch.from(h)] && rim[patch.to(h)] ? 1 : 0;
        return count;
    };
    EXPECT_LE(chords(rock.patch), chords(cut));
}

// Of a whole atlas: charts' sides go through vertices where they can, and nothing else is left of any cut.
TEST(MergedPieces, LeavesHaveFewPieces) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 20000);
    const Atlas atlas = small_atlas(mesh, 16, 8, true);
    std::set<std::array<uint32_t, 3>> inside, on_sides;
    for (uint32_t p = 0; p < atlas.leaf_parts.size(); ++p) {
        for (const LeafVertex& v : decoded_leaf(atlas, p).vertices)
            (v.border == 0 ? inside : on_sides).insert(v.position);
    }
    std::printf("%zu vertices: %zu inside, %zu on sides; %llu triangles of %zu\n", mesh.vertex_count(), inside.size(),
                on_sides.size(), static_cast<unsigned long long>(leaf_triangles(atlas)), mesh.triangle_count());
    EXPECT_LT(inside.size(), mesh.vertex_count());
    EXPECT_LT(leaf_triangles(atlas), mesh.triangle_count() * 11 / 10);
}

}  // namespace
}  // namespace lodestone::vgi
