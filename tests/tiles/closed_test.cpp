// Any set of tiles that covers the surface once is closed: edge by edge, and pixel by pixel.
#include <gtest/gtest.h>

#include <cmath>

#include "fixtures/meshes.h"
#include "fixtures/real_data.h"
#include "mesh/repair.h"
#include "tiles/cut_surface.h"
#include "tiles/exact_raster.h"

namespace lodestone::tiles {
namespace {

struct Edges {
    uint64_t unmatched = 0, repeated = 0;  // unmatched: left over, and not as of the leaves
    uint64_t rim = 0;                      // that the leaves leave over
    uint32_t largest_step = 0;
};

// What random cuts leave over. without_closing: the triangles that close borders are left out.
Edges edges_of_cuts(const TiledSurface& surface, int cuts, bool without_closing = false) {
    Edges edges;
    Places places;
    std::vector<std::vector<BorderEdge>> borders;
    EdgeSum leaves;
    for (uint32_t t = 0; t < surface.meshes.size(); ++t) {
        const TileMesh& mesh = surface.meshes[t];
        const size_t count = without_closing ? mesh.surface_triangles : mesh.triangles.size();
        borders.push_back(border_of(corners_of(mesh, count, places), &edges.repeated));
        if (surface.tree.nodes[t].children.empty()) leaves.add(borders.back());
    }
    const std::vector<BorderEdge> rim = leaves.left();
    edges.rim = rim.size();
    Random random(7);
    for (int i = 0; i < cuts; ++i) {
        const std::vector<uint32_t> cut = random_cut(surface.tree, random);
        EdgeSum sum;
        for (const uint32_t tile : cut) sum.add(borders[tile]);
        sum.take(rim);
        edges.unmatched += sum.left().size();
        edges.largest_step = std::max(edges.largest_step, largest_step(surface.tree, cut));
    }
    return edges;
}

TEST(ClosedCuts, EveryEdgeIsRunThroughOnceEachWay) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        for (const bool leaves : {false, true}) {
            SCOPED_TRACE(f.name + (leaves ? ", leaves" : ""));
            const Edges edges = edges_of_cuts(tiled(vgi::small_atlas(f.mesh, 32, 8, leaves)), 50);
            EXPECT_EQ(edges.unmatched, 0u);
            // Small closed pieces are two charts, which lie on each other at the coarsest level.
            EXPECT_TRUE(leaves || edges.repeated == 0 || f.name == "grid with debris");
        }
    }
}

TEST(ClosedCuts, LevelsSideBySideAreFarApartAndLeakWithoutClosingTriangles) {
    const TiledSurface surface = tiled(vgi::small_atlas(fixtures::repaired(Shape::rock, 4000), 64));
    const Edges closed = edges_of_cuts(surface, 50), open = edges_of_cuts(surface, 50, true);
    EXPECT_EQ(closed.unmatched, 0u);
    EXPECT_GE(closed.largest_step, 3u);
    EXPECT_GT(open.unmatched, 1000u);
}

TEST(ClosedCuts, AClosingTriangleThatIsMissingIsNoticed) {
    TiledSurface surface = tiled(vgi::small_atlas(fixtures::torus(24, 12), 32));
    size_t dropped = 0;
    for (TileMesh& mesh : surface.meshes) {
        if (mesh.triangles.size() > mesh.surface_triangles && dropped++ < 1) mesh.triangles.pop_back();
    }
    ASSERT_GT(dropped, 1u);
    EXPECT_GT(edges_of_cuts(surface, 100).unmatched, 0u);
}

TEST(ClosedCuts, OfAnOpenSurfaceTheRimOfItsLeavesIsLeftOver) {
    const TiledSurface surface = tiled(vgi::small_atlas(fixtures::bumpy_grid(20, 20), 32));
    const Edges closed = edges_of_cuts(surface, 50);
    EXPECT_GT(closed.rim, 50u);
    EXPECT_EQ(closed.unmatched, 0u);
    EXPECT_GT(edges_of_cuts(surface, 50, true).unmatched, 0u);
}

// Two sheets that touch in every second vertex of their rims.
TriMesh stitched_sheets() {
    constexpr int cells = 16;
    TriMesh mesh;
    for (const float height : {0.1f, -0.1f}) {
        const TriMesh sheet = fixtures::bumpy_grid(cells, cells);
        const auto first = static_cast<uint32_t>(mesh.positions.size());
        for (uint32_t i = 0; i < sheet.positions.size(); ++i) {
            const uint32_t x = i % (cells + 1), y = i / (cells + 1);
            const bool on_rim = x % cells == 0 || y % cells == 0;
            glm::vec3 p = sheet.positions[i];
            p.y = on_rim && (x + y) % 2 == 0 ? 0 : height;
            mesh.positions.push_back(p);
        }
        for (const Triangle& t : sheet.triangles) {
            const auto vertex = [&](uint32_t wedge) { return sheet.wedge_vertex[wedge] + first; };
            mesh.triangles.push_back({vertex(t[0]), vertex(t[1]), vertex(t[2])});
        }
    }
    mesh.set_identity_wedges();
    return mesh;
}

TEST(ClosedCuts, RimsMayTouch) {
    TriMesh mesh = stitched_sheets();
    ASSERT_TRUE(repair(mesh));
    const TiledSurface surface = tiled(vgi::small_atlas(mesh, 32));
    const Edges closed = edges_of_cuts(surface, 20), open = edges_of_cuts(surface, 20, true);
    EXPECT_EQ(closed.unmatched, 0u);
    EXPECT_GT(open.unmatched, 0u);
}

// Two charts side by side that are not joined, though their samples are the same there.
vgi::Atlas unjoined_charts() {
    vgi::Atlas atlas;
    atlas.cells = atlas.attribute_cells = 32;
    atlas.lay_out({0, 0}, {0, 0});
    atlas.make_room();
    atlas.sides.resize(8);
    for (uint32_t chart = 0; chart < 2; ++chart) {
        for (uint32_t y = 0; y <= 32; ++y) {
            for (uint32_t x = 0; x <= 32; ++x) {
                const double u = x + 32.0 * chart, height = 300 * std::sin(0.3 * y + 0.1 * u);
                atlas.positions[atlas.texel(chart, x, y)] = {static_cast<uint16_t>(100 * u),
                                                             static_cast<uint16_t>(100 * y),
                                                             static_cast<uint16_t>(1000 + height)};
            }
        }
    }
    return atlas;
}

TEST(ClosedCuts, RimsThatAreOneLineAreClosed) {
    const TiledSurface surface = tiled(unjoined_charts());
    const Edges edges = edges_of_cuts(surface, 50);
    EXPECT_EQ(edges.unmatched, 0u);
    EXPECT_GE(edges.largest_step, 2u);
}

struct Pixels {
    uint64_t covered = 0, leaks = 0, unequal = 0;
    int pictures = 0;
};

Pixels pixels_of_cuts(const TiledSurface& surface, int cuts, uint32_t size, bool without_closing = false) {
    Pixels pixels;
    Random random(11);
    glm::dvec3 low(65535), high(0);
    for (const auto& p : surface.atlas.positions) {
        low = glm::min(low, glm::dvec3(p[0], p[1], p[2]));
        high = glm::max(high, glm::dvec3(p[0], p[1], p[2]));
    }
    const glm::dvec3 middle = (low + high) * 0.5;
    const double extent = glm::length(high - low);
    for (int i = 0; i < cuts; ++i) {
        glm::dvec3 towards(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        towards = glm::normalize(towards + glm::dvec3(1e-3));
        const glm::dvec3 eye = middle + towards * (extent * random.uniform(0.6, 1.5));
        const glm::dvec3 aside = glm::dvec3(random.unit(), random.unit(), random.unit()) * (0.2 * extent);
        ExactRaster raster(size, eye, middle + aside);
        bool whole = true;
        for (const uint32_t tile : random_cut(surface.tree, random)) {
            const TileMesh& mesh = surface.meshes[tile];
            const size_t count = without_closing ? mesh.surface_triangles : mesh.triangles.size();
            for (size_t t = 0; t < count && whole; ++t) {
                std::array<glm::dvec3, 3> corners;
                for (size_t k = 0; k < 3; ++k) {
                    corners[k] = in_steps(surface.atlas, mesh.vertices[mesh.triangles[t][k]].position);
                }
                whole = raster.draw(corners);
            }
        }
        if (!whole) continue;
        const ExactRaster::Counts counts = raster.counts();
        pixels.covered += counts.covered;
        pixels.leaks += counts.leaks;
        pixels.unequal += counts.unequal;
        ++pixels.pictures;
    }
    return pixels;
}

TEST(ClosedCuts, EveryPixelHasAsManyFrontsAsBacks) {
    const TiledSurface surface = tiled(vgi::small_atlas(fixtures::repaired(Shape::rock, 4000), 64));
    const Pixels closed = pixels_of_cuts(surface, 12, 300), open = pixels_of_cuts(surface, 12, 300, true);
    EXPECT_GE(closed.pictures, 10);
    EXPECT_GT(closed.covered, 100000u);
    EXPECT_EQ(closed.leaks, 0u);
    EXPECT_EQ(closed.unequal, 0u);
    EXPECT_GT(open.leaks, 0u);
    EXPECT_GT(open.unequal, 100u);
}

// Large ones: a rock, a terrain, one of 40 components, a scan with holes.
TriMesh forty_rocks() {
    TriMesh all;
    for (uint64_t seed = 0; seed < 40; ++seed) {
        const TriMesh rock = fixtures::repaired(Shape::rock, 800, seed + 1);
        const auto first = static_cast<uint32_t>(all.positions.size());
        for (const glm::vec3& p : rock.positions)
            all.positions.push_back(p * (0.2f + 0.01f * static_cast<float>(seed)) +
                                    glm::vec3(static_cast<float>(seed % 8), static_cast<float>(seed / 8), 0) * 2.0f);
        const auto vertex = [&](uint32_t wedge) { return rock.wedge_vertex[wedge] + first; };
        for (const Triangle& t : rock.triangles) all.triangles.push_back({vertex(t[0]), vertex(t[1]), vertex(t[2])});
    }
    all.set_identity_wedges();
    return all;
}

// Of samples alone, and of leaves. pictures: also counts fronts and backs in so many.
void expect_closed_thousand(const TriMesh& mesh, uint32_t cells, uint32_t clusters, int pictures = 0) {
    for (const bool leaves : {false, true}) {
        SCOPED_TRACE(leaves ? "leaves" : "samples");
        const TiledSurface surface = tiled(vgi::small_atlas(mesh, cells, clusters, leaves), 512);
        EXPECT_GT(surface.tree.nodes.size(), 50u);
        const Edges edges = edges_of_cuts(surface, 1000);
        EXPECT_EQ(edges.unmatched, 0u);
        EXPECT_GE(edges.largest_step, 2u);
        if (pictures == 0) continue;
        const Pixels pixels = pixels_of_cuts(surface, pictures, 400);
        EXPECT_EQ(pixels.leaks, 0u);
        EXPECT_EQ(pixels.unequal, 0u);
        std::cout << surface.tree.nodes.size() << " tiles; " << pixels.pictures << " pictures, " << pixels.covered
                  << " pixels covered\n";
    }
}

TEST(ClosedCutsLong, AThousandOfARock) { expect_closed_thousand(fixtures::repaired(Shape::rock, 200000), 64, 20, 200); }
TEST(ClosedCutsLong, AThousandOfATerrain) {
    expect_closed_thousand(fixtures::repaired(Shape::terrain, 100000), 64, 20);
}
TEST(ClosedCutsLong, AThousandOfFortyRocks) { expect_closed_thousand(forty_rocks(), 32, 60, 100); }
TEST(ClosedCutsLong, AThousandOfAScanWithHoles) {
    const char* scan = "nasty/elephant-with-holes.off";
    if (!fixtures::real_data(scan)) GTEST_SKIP() << fixtures::missing_data_note(scan);
    const auto mesh = fixtures::repaired_real_mesh(scan);
    ASSERT_TRUE(mesh);
    expect_closed_thousand(*mesh, 64, 40);
}
// Edges of three triangles and more, components that touch, pieces side by side.
TEST(ClosedCutsLong, FiftyOfMeshesWhoseRimsTouch) {
    for (const char* name : {"nasty/bun_zipper_res3.ply", "nasty/pig.stl", "nasty/brain.ply", "nasty/truck.obj",
                             "nasty/featuretype.STL", "large/terrain_tileset_leaves.ply"}) {
        SCOPED_TRACE(name);
        if (!fixtures::real_data(name)) GTEST_SKIP() << fixtures::missing_data_note(name);
        const auto mesh = fixtures::repaired_real_mesh(name);
        ASSERT_TRUE(mesh);
        for (const bool leaves : {false, true})
            EXPECT_EQ(edges_of_cuts(tiled(vgi::small_atlas(*mesh, 64, 40, leaves), 512), 50).unmatched, 0u) << leaves;
    }
}

}  // namespace
}  // namespace lodestone::tiles
