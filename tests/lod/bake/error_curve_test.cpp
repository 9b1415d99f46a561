#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "fixtures/meshes.h"
#include "lod/asset/cursor.h"
#include "lod/asset/level_steps.h"
#include "lod/bake/bake.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"

namespace lodestone {
namespace {

ProgressiveMesh measured(const TriMesh& mesh, const Simplifier& simplifier = *make_quadric_simplifier()) {
    const auto list = simplifier.simplify(mesh, {});
    auto pm = bake_progressive_mesh(mesh, *list, {"static"});
    auto errors = measure_errors(*pm);
    EXPECT_TRUE(errors);
    pm->set_errors(std::move(*errors));
    return std::move(*pm);
}

TEST(ErrorCurve, BeginsAtZeroAndRisesWithEveryLevel) {
    for (const auto& f : fixtures::manifold_meshes()) {
        SCOPED_TRACE(f.name);
        const ProgressiveMesh pm = measured(f.mesh);
        EXPECT_EQ(pm.errors[0], 0);
        EXPECT_EQ(std::ranges::adjacent_find(pm.errors, std::greater_equal<>{}), pm.errors.end());
        EXPECT_EQ(level_steps(pm).distinct_errors, pm.levels());
    }
}

// With samples that were not used. A level may be nearer to the source than a finer one was.
TEST(ErrorCurve, StatesWhatExtractShowsAndLittleMore) {
    for (const Shape shape : {Shape::rock, Shape::terrain, Shape::torus}) {
        const TriMesh mesh = generate(shape, 1500, 11);
        const ProgressiveMesh pm = measured(mesh);
        DistanceOptions options;
        options.samples = 60000;
        options.seed = 99;
        const MeasuredSurface source(mesh, options);
        uint32_t looked_at = 0, near = 0;
        for (uint32_t level = 7; level < pm.levels(); level += pm.levels() / 40 + 1, ++looked_at) {
            const MeasuredSurface there(*extract_level(pm, level), options);
            const double distance = source.farthest_from(there, there.farthest_from(source, 0));
            const auto stated = static_cast<double>(pm.errors[level]);
            EXPECT_LE(distance, stated) << "level " << level << " of " << pm.levels();
            near += stated <= 1.35 * distance;
        }
        EXPECT_GE(near, looked_at * 0.9) << "of " << looked_at;
    }
}

TEST(ErrorCurve, AFlatGridLosesNothingUntilItsBase) {
    const ProgressiveMesh pm = measured(fixtures::grid(20, 20));
    EXPECT_LT(pm.errors[pm.levels() / 2], 1e-5f);
}

TEST(ErrorCurve, StaysBetweenTheBoundsOfWhatWasMeasured) {
    // Nothing lost, a plateau, a jump, another plateau, and a level that loses no triangle.
    const std::vector<double> found = {0, 0, 0, 1, 1, 1, 1, 4, 4, 4, 4};
    const std::vector<uint32_t> triangles = {1000, 900, 800, 700, 600, 600, 400, 300, 200, 100, 50};
    const auto stated = stated_errors(found, triangles, 0.01);
    ASSERT_EQ(stated.size(), found.size());
    EXPECT_EQ(stated[0], 0);
    for (size_t level = 1; level < found.size(); ++level) {
        EXPECT_GT(stated[level], stated[level - 1]) << level;
        EXPECT_GE(stated[level], found[level] * stated_least * 0.99999) << level;
        EXPECT_LE(stated[level], std::max(found[level], 0.01) * stated_most * 1.00001) << level;
    }
    EXPECT_EQ(stated_errors({0}, {12}, 1), std::vector<float>{0});
}

// Of baked assets: an error that grows by 1% takes few triangles with it, wherever.
TEST(LevelSteps, AreSmallOnBakedMeshes) {
    for (const Shape shape : {Shape::rock, Shape::terrain, Shape::vase}) {
        const TriMesh mesh = fixtures::repaired(shape, 12000);
        const LevelSteps steps = level_steps(measured(mesh));
        EXPECT_GT(steps.largest_step, 0);
        EXPECT_LE(steps.largest_step, 0.05);
        EXPECT_LE(steps.median_step, 0.015);
        EXPECT_EQ(steps.diagonal, static_cast<double>(bounding_box(mesh.positions).diagonal()));
    }
    const LevelSteps steps = level_steps(measured(fixtures::repaired(Shape::rock, 12000), *make_openmesh_simplifier()));
    EXPECT_GT(steps.largest_step, 0);
    EXPECT_LE(steps.largest_step, 0.05);
}

TEST(LevelSteps, TellOfPlateaus) {
    ProgressiveMesh pm = measured(fixtures::repaired(Shape::rock, 6000));
    std::vector<float> errors(pm.errors.begin(), pm.errors.end());
    const uint32_t from = pm.level_for_triangles(5000), to = pm.level_for_triangles(4000);
    for (uint32_t level = from; level < to; ++level) errors[level] = errors[to];
    pm.set_errors(errors);
    const LevelSteps steps = level_steps(pm);
    EXPECT_EQ(steps.distinct_errors, pm.levels() - (to - from));
    EXPECT_GE(steps.largest_step, 0.19);
}

}  // namespace
}  // namespace lodestone
