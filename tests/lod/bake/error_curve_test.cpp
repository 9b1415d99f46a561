#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"

#include <gtest/gtest.h>

#include "fixtures/meshes.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"

namespace lodestone {
namespace {

ProgressiveMesh measured(const TriMesh& mesh) {
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    auto pm = bake_progressive_mesh(mesh, *list, {"static"});
    auto errors = measure_errors(*pm);
    EXPECT_TRUE(errors);
    pm->set_errors(std::move(*errors));
    return std::move(*pm);
}

TEST(ErrorCurve, BeginsAtZeroAndNeverFalls) {
    for (const auto& f : fixtures::manifold_meshes()) {
        SCOPED_TRACE(f.name);
        const ProgressiveMesh pm = measured(f.mesh);
        EXPECT_EQ(pm.errors[0], 0);
        EXPECT_TRUE(std::is_sorted(pm.errors.begin(), pm.errors.end()));
    }
}

// At levels that were not measured, with samples that were not used.
TEST(ErrorCurve, BoundsWhatExtractShows) {
    for (const Shape shape : {Shape::rock, Shape::terrain, Shape::torus}) {
        const TriMesh mesh = generate(shape, 1500, 11);
        const ProgressiveMesh pm = measured(mesh);
        for (uint32_t level = 7; level < pm.levels(); level += pm.levels() / 23 + 1) {
            DistanceOptions options;
            options.samples = 30000;
            options.seed = 99;
            const double distance = surface_distance(mesh, *extract_level(pm, level), options).max();
            EXPECT_LE(distance, static_cast<double>(pm.errors[level])) << "level " << level << " of " << pm.levels();
        }
    }
}

TEST(ErrorCurve, AFlatGridLosesNothingUntilItsBase) {
    const ProgressiveMesh pm = measured(fixtures::grid(20, 20));
    EXPECT_LT(pm.errors[pm.levels() / 2], 1e-5f);
}

}  // namespace
}  // namespace lodestone
