#include "vgi/asset/atlas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <glm/geometric.hpp>

#include "base/threads.h"
#include "fixtures/meshes.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "mesh/topology.h"
#include "vgi/asset/atlas_chunks.h"
#include "vgi/asset/pages.h"
#include "vgi/bake/bake.h"
#include "vgi/extract/extract.h"

namespace lodestone::vgi {
namespace {

Atlas atlas_of(const TriMesh& mesh, uint32_t clusters, uint32_t cells, AtlasReport* report = nullptr) {
    AtlasOptions options;
    options.clusters.clusters = clusters;
    options.cells = cells;
    options.error_samples = 20000;
    AtlasReport mine;
    auto atlas = make_atlas(mesh, options, report != nullptr ? *report : mine);
    EXPECT_TRUE(atlas) << atlas.error().message;
    return atlas ? std::move(*atlas) : Atlas{};
}

TEST(Atlas, IsValidAndKeepsTheTopologyOfAnyMeshAtEveryLevel) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        for (const uint32_t clusters : {1u, 12u}) {
            SCOPED_TRACE(f.name + " " + std::to_string(clusters));
            AtlasReport report;
            const Atlas atlas = atlas_of(f.mesh, clusters, 16, &report);
            const auto valid = atlas.validate();
            ASSERT_TRUE(valid) << valid.error().message;
            EXPECT_EQ(report.flipped_triangles, 0u);
            EXPECT_EQ(report.missing_samples, 0u);
            EXPECT_GE(report.l2_stretch_rms, 1 - 1e-9);
            EXPECT_LE(report.l2_stretch_rms, report.l2_stretch_tutte + 1e-9);
            const Topology source = topology_of(f.mesh);
            for (uint32_t level = 0; level < atlas.levels(); ++level) {
                const TriMesh mesh = extract_samples(atlas, level);
                ASSERT_TRUE(mesh.validate());
                EXPECT_EQ(mesh.triangle_count(), atlas.triangles_at(level));
                const Topology t = topology_of(mesh);
                EXPECT_EQ(t.components, source.components) << level;
                EXPECT_EQ(t.boundary_loops, source.boundary_loops) << level;
                EXPECT_EQ(t.genus, source.genus) << level;
                EXPECT_TRUE(t.manifold()) << level;
            }
        }
    }
}

TEST(Atlas, ComesCloserToTheSourceWithEveryFinerLevel) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 6000);
    const Atlas atlas = atlas_of(mesh, 20, 32);
    const double diagonal = bounding_box(mesh.positions).diagonal();
    double before = 1;
    for (uint32_t level = atlas.levels() - 1; level < atlas.levels(); --level) {
        const double rms = surface_distance(mesh, extract_samples(atlas, level)).rms() / diagonal;
        EXPECT_LT(rms, before) << level;
        before = rms;
    }
    EXPECT_LT(before, 1e-3);
}

TEST(Atlas, MeasuresItsErrorsAsAnIndependentDistanceDoes) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        AtlasReport report;
        const Atlas atlas = atlas_of(f.mesh, 12, 16, &report);
        const double diagonal = bounding_box(f.mesh.positions).diagonal();
        const TwoSidedDistance finest = surface_distance(f.mesh, extract_samples(atlas, 0));
        EXPECT_NEAR(report.rms_error, finest.rms(), 0.1 * finest.rms() + 2e-6 * diagonal);
        EXPECT_LE(report.max_error, 1.1 * finest.max() + 2e-6 * diagonal);
        EXPECT_GE(report.max_error, 0.5 * finest.max() - 2e-6 * diagonal);
        // A level's error is a promise.
        for (uint32_t level = 0; level < atlas.levels(); ++level)
            EXPECT_LE(surface_distance(f.mesh, extract_samples(atlas, level)).max(),
                      static_cast<double>(atlas.errors[level]) + 2e-6 * diagonal)
                << level;
    }
}

TEST(Atlas, KeepsSeamsOfAttributesInsideCharts) {
    // Every sample's texture coordinate is one of the source near by: none is smeared across the seam.
    const TriMesh mesh = fixtures::repaired(Shape::torus, 3000);
    ASSERT_TRUE(mesh.has_seams());
    const TriMesh extracted = extract_samples(atlas_of(mesh, 12, 32), 0);
    ASSERT_EQ(extracted.uvs.size(), extracted.wedge_count());
    std::vector<uint32_t> indices;
    for (size_t t = 0; t < mesh.triangle_count(); ++t)
        for (int k = 0; k < 3; ++k) indices.push_back(mesh.vertex_of(t, k));
    const ClosestSurface surface(mesh.positions, indices);
    for (size_t w = 0; w < extracted.wedge_count(); w += 7) {
        const auto hit = surface.closest(glm::dvec3(extracted.positions[extracted.wedge_vertex[w]]));
        float nearest = 1e9f;
        for (int k = 0; k < 3; ++k) {
            const glm::vec2 d = extracted.uvs[w] - mesh.uvs[mesh.triangles[hit.triangle][static_cast<size_t>(k)]];
            nearest = std::min(nearest, std::max(std::abs(d.x), std::abs(d.y)));
        }
        // Within a triangle's reach of the nearest triangle, or on the other side of a seam it lies on.
        EXPECT_TRUE(nearest < 0.1f || nearest > 0.9f) << w;
    }
}

TEST(Atlas, IsTheSameForAnyNumberOfThreadsAndAtAnyScale) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 6000);
    set_thread_count(1);
    const Atlas first = atlas_of(mesh, 20, 16);
    for (const unsigned threads : {2u, 8u}) {
        set_thread_count(threads);
        const Atlas again = atlas_of(mesh, 20, 16);
        EXPECT_EQ(again.positions, first.positions);
        EXPECT_EQ(again.normals, first.normals);
        EXPECT_EQ(again.sides, first.sides);
    }
    set_thread_count(0);
    for (const float scale : {0.0009765625f, 1024.0f}) {
        TriMesh scaled = mesh;
        for (glm::vec3& p : scaled.positions) p *= scale;
        EXPECT_EQ(atlas_of(scaled, 20, 16).sides, first.sides) << scale;
    }
}

TEST(Atlas, SmallComponentsAreTemplatesWithFewSamplesAndTakeNothingFromOthers) {
    const TriMesh mesh = fixtures::grid_with_debris();
    AtlasReport alone, report;
    const Atlas grid = atlas_of(fixtures::bumpy_grid(16, 12), 20, 128, &alone);
    const Atlas atlas = atlas_of(mesh, 20, 128, &report);
    ASSERT_TRUE(atlas.validate());
    EXPECT_EQ(atlas.cells, 128u);
    EXPECT_EQ(report.template_charts, 1 + 2 + 2 + 1u) << "the torus has clusters";
    EXPECT_GE(std::ranges::count(atlas.trimmed_levels, 2), 6);
    EXPECT_NEAR(static_cast<double>(std::ranges::count(atlas.trimmed_levels, 0)), grid.charts(), 8);
    // Small as they are, their samples are closer together than the grid's.
    EXPECT_LT(report.max_error, 0.05 * 0.1) << "of the size of the pieces";
}

TEST(Atlas, ManyComponentsAreSampledAsMemoryAllows) {
    TriMesh mesh;
    const TriMesh one = fixtures::torus(6, 5);
    for (uint32_t i = 0; i < 100; ++i) {
        for (Triangle t : one.triangles) {
            for (uint32_t& w : t) w += static_cast<uint32_t>(mesh.positions.size());
            mesh.triangles.push_back(t);
        }
        for (const glm::vec3& p : one.positions)
            mesh.positions.push_back(p + glm::vec3(3.0f * static_cast<float>(i), 0, 0));
    }
    mesh.set_identity_wedges();
    AtlasReport report;
    const Atlas atlas = atlas_of(mesh, 4, 128, &report);
    EXPECT_GE(report.clusters, 400u);
    EXPECT_LT(report.cells, 128u);
    EXPECT_EQ(atlas.cells, report.cells);
    EXPECT_TRUE(atlas.validate());
}

TEST(Atlas, PutsBordersOnCreases) {
    TriMesh cube = fixtures::cube_with_seams();
    cube.normals.clear();
    ASSERT_TRUE(repair(cube));
    const FeatureLines features(cube);
    uint32_t creases = 0;
    for (uint32_t a = 0; a < cube.triangle_count(); ++a) {
        for (uint32_t b = 0; b < a; ++b) {
            if (!features.between(a, b)) continue;
            ++creases;
            EXPECT_TRUE(features.between(b, a));
        }
    }
    EXPECT_EQ(creases, 12u);
    AtlasOptions options;
    options.clusters.clusters = 24;
    options.cells = 32;
    options.error_samples = 5000;
    AtlasReport kept, hidden;
    ASSERT_TRUE(make_atlas(cube, options, kept));
    options.clusters.weights.feature = 0;
    ASSERT_TRUE(make_atlas(cube, options, hidden));
    EXPECT_GT(kept.features_on_borders, 0.95);
    // A cube whose edges are borders is sampled exactly.
    EXPECT_LT(kept.rms_error, 0.05 * hidden.rms_error);
}

TEST(Atlas, HasAttributesFinerThanPositionsWhereAsked) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 6000);
    AtlasOptions options;
    options.clusters.clusters = 6;
    options.cells = 16;
    options.error_samples = 1000;
    AtlasReport report;
    const auto coarse = make_atlas(mesh, options, report);
    options.attribute_ratio = 4;
    const auto fine = make_atlas(mesh, options, report);
    ASSERT_TRUE(coarse);
    ASSERT_TRUE(fine);
    EXPECT_TRUE(fine->validate());
    EXPECT_EQ(fine->attribute_cells, 64u);
    ASSERT_EQ(fine->positions.size(), coarse->positions.size());
    ASSERT_EQ(fine->normals.size(), size_t{fine->charts()} * 65 * 65);
    for (uint32_t c = 0; c < fine->charts(); ++c) {
        for (uint32_t y = 0; y <= 16; ++y) {
            for (uint32_t x = 0; x <= 16; ++x) {
                // The same but for rounding.
                const size_t texel = fine->texel(c, x, y);
                ASSERT_LE(glm::distance(fine->position(texel), coarse->position(texel)), 3 * fine->step);
                ASSERT_GE(glm::dot(fine->normal(fine->attribute_texel(c, 4 * x, 4 * y)),
                                   coarse->normal(coarse->attribute_texel(c, x, y))),
                          0.999f);
            }
        }
    }
    EXPECT_EQ(extract_samples(*fine, 1).wedge_count(), extract_samples(*coarse, 1).wedge_count());
}

TEST(Atlas, NoticesWhatIsBroken) {
    const Atlas good = atlas_of(fixtures::repaired(Shape::rock, 3000), 8, 8);
    Atlas bad = good;
    const GluedSide glued = bad.sides[0];
    bad.positions[bad.texel(0, 3, 0)][1] ^= 1;
    EXPECT_THAT(bad.validate().error().message, testing::HasSubstr("differs"));
    bad = good;
    bad.sides[0] = {glued.chart, (glued.side + 1) % 4};
    EXPECT_THAT(bad.validate().error().message, testing::HasSubstr("glued elsewhere"));
    bad = good;
    bad.normals.pop_back();
    EXPECT_THAT(bad.validate().error().message, testing::HasSubstr("wrong size"));
}

TEST(Atlas, ComesBackFromAFileTexelForTexel) {
    const auto path =
        std::filesystem::temp_directory_path() / ("lodestone-atlas-" + std::to_string(getpid()) + ".lode");
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        for (const uint32_t cells : {8u, 32u, 64u}) {
            SCOPED_TRACE(f.name + " " + std::to_string(cells));
            const Atlas atlas = atlas_of(f.mesh, 6, cells);
            auto writer = ChunkWriter::create(path, {});
            ASSERT_TRUE(writer);
            ASSERT_TRUE(write_chunks(atlas, *writer));
            ASSERT_TRUE(writer->commit());
            const auto file = ChunkFile::open(path);
            ASSERT_TRUE(file);
            const auto read = open_atlas(*file);
            ASSERT_TRUE(read) << read.error().message;
            EXPECT_EQ(read->positions, atlas.positions);
            EXPECT_EQ(read->normals, atlas.normals);
            EXPECT_EQ(read->uvs, atlas.uvs);
            EXPECT_EQ(read->colours, atlas.colours);
            EXPECT_EQ(read->materials, atlas.materials);
            EXPECT_EQ(read->sides, atlas.sides);
            EXPECT_EQ(read->errors, atlas.errors);
            EXPECT_EQ(read->sample_errors, atlas.sample_errors);
            EXPECT_EQ(read->sample_radii, atlas.sample_radii);
            EXPECT_EQ(read->bounds, atlas.bounds);
            EXPECT_EQ(read->step, atlas.step);
        }
    }
    std::filesystem::remove(path);
}

TEST(PageTree, NumbersPagesCoarsestFirst) {
    const PageTree tree{128};
    EXPECT_EQ(tree.pages(), 21u);
    EXPECT_EQ(tree.base_level(), 2u);
    std::vector<bool> seen(tree.pages(), false);
    for (uint32_t level = 0; level <= 2; ++level) {
        for (uint32_t y = 0; y < tree.pages_per_side(level); ++y) {
            for (uint32_t x = 0; x < tree.pages_per_side(level); ++x) {
                const uint32_t page = tree.page(level, x, y);
                uint32_t l = 9, px = 9, py = 9;
                tree.place(page, &l, &px, &py);
                EXPECT_EQ(std::tuple(l, px, py), std::tuple(level, x, y));
                seen.at(page) = true;
            }
        }
    }
    EXPECT_EQ(std::ranges::count(seen, true), 21);
    EXPECT_EQ(tree.page(2, 0, 0), 0u);
    EXPECT_EQ(PageTree{16}.pages(), 1u);
}

TEST(Atlas, TakesEdgesOfHardlyAnyLength) {
    // Every other column of a grid lies on the one before but for a last bit: borders end in steps that add nothing.
    for (const size_t triangles : {200u, 800u}) {
        TriMesh mesh = generate(Shape::grid, triangles, 1);
        for (glm::vec3& p : mesh.positions) p.y = 0;
        std::vector<float> columns;
        for (const glm::vec3& p : mesh.positions) columns.push_back(p.x);
        std::ranges::sort(columns);
        columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
        for (glm::vec3& p : mesh.positions) {
            const auto column = static_cast<size_t>(std::ranges::lower_bound(columns, p.x) - columns.begin());
            if (column % 2 == 1) p = {columns[column - 1], 1e-35f, p.z};
        }
        ASSERT_TRUE(repair(mesh));
        for (const uint32_t clusters : {3u, 6u, 12u, 40u}) {
            AtlasOptions options;
            options.clusters.clusters = clusters;
            options.cells = 16;
            options.error_samples = 1000;
            AtlasReport report;
            const auto atlas = make_atlas(mesh, options, report);
            ASSERT_TRUE(atlas) << atlas.error().message;
            EXPECT_TRUE(atlas->validate());
        }
    }
}

}  // namespace
}  // namespace lodestone::vgi
