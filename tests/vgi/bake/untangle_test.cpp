#include "vgi/bake/images/untangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "mesh/generate.h"
#include "vgi/bake/bake.h"
#include "vgi/extract/extract.h"

namespace lodestone::vgi {
namespace {

// Triangles of the finest level that do not look along an axis.
uint64_t looking_away(const Atlas& atlas, const glm::dvec3& axis) {
    uint64_t count = 0;
    const TriMesh mesh = extract_samples(atlas, 0);
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const glm::dvec3 area = area_vector(glm::dvec3(mesh.position_of(t, 0)), glm::dvec3(mesh.position_of(t, 1)),
                                            glm::dvec3(mesh.position_of(t, 2)));
        count += glm::dot(area, axis) <= 0;
    }
    return count;
}

TEST(Unfold, HeightFieldsHaveNoTriangleThatLooksDown) {
    AtlasOptions options;
    options.clusters.clusters = 40;
    options.cells = 64;
    options.error_samples = 1000;
    uint32_t folded = 0;
    for (const uint64_t seed : {1, 2, 3}) {
        TriMesh mesh = generate(Shape::terrain, 50000, seed);
        glm::dvec3 axis(0, 1, 0);
        if (seed == 2) {  // lying on its side
            for (glm::vec3& p : mesh.positions) p = {p.y, p.z, p.x};
            for (glm::vec3& n : mesh.normals) n = {n.y, n.z, n.x};
            axis = {1, 0, 0};
        }
        AtlasReport report;
        const auto atlas = make_atlas(mesh, options, report);
        ASSERT_TRUE(atlas) << atlas.error().message;
        EXPECT_EQ(looking_away(*atlas, axis), 0u) << seed;
        EXPECT_EQ(report.still_folded_cells, 0u) << seed;
        folded += report.folded_cells;
    }
    EXPECT_GT(folded, 50u) << "nothing was there to untangle";
}

TEST(Unfold, KnowsHeightFields) {
    TriMesh terrain = generate(Shape::terrain, 1000);
    EXPECT_EQ(height_axis(terrain), glm::dvec3(0, 1, 0));
    for (Triangle& t : terrain.triangles) std::swap(t[1], t[2]);
    EXPECT_EQ(height_axis(terrain), glm::dvec3(0, -1, 0));
    EXPECT_EQ(height_axis(generate(Shape::rock, 1000)), std::nullopt);
    EXPECT_EQ(height_axis(generate(Shape::cliff, 20000)), std::nullopt);
}

// A flat square of cells x cells, sampled where its vertices lie, but for some samples.
struct Square {
    Surface surface;
    ChartMesh patch;
    std::vector<SurfaceSample> places;

    explicit Square(uint32_t cells) {
        const uint32_t row = cells + 1;
        for (uint32_t y = 0; y < row; ++y) {
            for (uint32_t x = 0; x < row; ++x) surface.positions.emplace_back(x, 0, -static_cast<double>(y));
        }
        std::vector<uint32_t> all;
        for (uint32_t y = 0; y < cells; ++y) {
            for (uint32_t x = 0; x < cells; ++x) {
                const uint32_t a = y * row + x;
                surface.triangles.push_back({{a, a + 1, a + row + 1}, 0});
                surface.triangles.push_back({{a, a + row + 1, a + row}, 0});
            }
        }
        for (uint32_t t = 0; t < surface.triangles.size(); ++t) all.push_back(t);
        patch = take_chart_mesh(surface, all);
        places.resize(size_t{row} * row);
        for (uint32_t t = 0; t < patch.triangles.size(); ++t) {
            for (uint32_t k = 0; k < 3; ++k) {
                glm::dvec3 weights(0);
                weights[static_cast<int>(k)] = 1;
                places[surface.triangles[t].vertices[k]] = SurfaceSample(patch, t, weights);
            }
        }
    }
};

TEST(Unfold, PutsSamplesThatChangedPlacesBackInOrder) {
    constexpr uint32_t cells = 16, row = cells + 1;
    Square square(cells);
    const auto in_order = square.places;
    Atlas lattice;
    lattice.origin = {0, 0, -16};
    lattice.step = 1.0 / 256;
    const auto run = [&] { return untangle(square.patch, square.places, cells, lattice, glm::dvec3(0, 1, 0)); };
    EXPECT_EQ(run().before, 0u);
    EXPECT_TRUE(run().moved.empty());
    std::swap(square.places[8 * row + 7], square.places[8 * row + 9]);
    std::swap(square.places[3 * row + 1], square.places[5 * row + 2]);
    const Untangled unfolded = run();
    EXPECT_GT(unfolded.before, 4u);
    EXPECT_EQ(unfolded.left, 0u);
    EXPECT_TRUE(std::ranges::is_sorted(unfolded.moved));
    for (const uint32_t s : unfolded.moved) {
        const uint32_t x = s % row, y = s / row;
        EXPECT_TRUE(x > 0 && y > 0 && x < cells && y < cells) << "samples on borders are shared";
    }
    EXPECT_EQ(run().before, 0u);
    // Four points of the lattice to a cell are too few to look for others.
    square.places = in_order;
    std::swap(square.places[8 * row + 7], square.places[8 * row + 9]);
    lattice.step = 0.5;
    EXPECT_GT(run().left, 0u);
    EXPECT_TRUE(run().moved.empty());
    lattice.step = 1.0 / 256;
    EXPECT_EQ(run().left, 0u);
    // What is out of order on the border stays, and is told.
    square.places = in_order;
    std::swap(square.places[7], square.places[9]);
    EXPECT_GT(run().left, 0u);
}

}  // namespace
}  // namespace lodestone::vgi
