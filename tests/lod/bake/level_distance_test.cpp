#include "lod/bake/level_distance.h"

#include <gtest/gtest.h>

#include "fixtures/meshes.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/distance/closest_point.h"

namespace lodestone {
namespace {

ProgressiveMesh baked(const TriMesh& mesh, const Simplifier& simplifier) {
    const auto list = simplifier.simplify(mesh, {});
    EXPECT_TRUE(list);
    return *bake_progressive_mesh(mesh, *list, {"static"});
}

double distance_to(const TriMesh& mesh, const glm::dvec3& place) {
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        const glm::dvec3 q =
            closest_on_triangle(place, mesh.position_of(t, 0), mesh.position_of(t, 1), mesh.position_of(t, 2));
        nearest = std::min(nearest, glm::distance(place, q));
    }
    return nearest;
}

// What is followed from collapse to collapse is there, and measuring each level from nothing does not find more.
void equals_measuring_every_level(const ProgressiveMesh& pm) {
    DistanceOptions options;
    options.samples = 6000;
    options.seed = 5;
    const TriMesh full = mesh_of(PmCursor(pm));
    const MeasuredSurface source(full, options);
    LevelDistance followed(pm, {20000, 1});
    PmCursor cursor(pm);
    double largest = 0, before = 0;
    for (uint32_t level = 1; level < pm.levels(); ++level) {
        cursor.goto_level(level);
        const TriMesh mesh = mesh_of(cursor);
        const MeasuredSurface there(mesh, options);
        largest = there.farthest_from(source, source.farthest_from(there, largest));
        const double found = followed.ecol(), rounding = 2 * followed.resolution();
        ASSERT_GE(found, 0.98 * largest - rounding) << "level " << level << " of " << pm.levels();
        if (found > before) {
            const LevelDistance::Witness& witness = followed.witness();
            ASSERT_NEAR(distance_to(witness.of_source ? full : mesh, witness.place), 0, rounding) << level;
            ASSERT_NEAR(distance_to(witness.of_source ? mesh : full, witness.place), found, rounding) << level;
        }
        before = found;
    }
    EXPECT_GT(before, 0);
}

TEST(LevelDistance, IsWhatMeasuringEveryLevelFinds) {
    for (const auto& [name, mesh] :
         {std::pair("rock", fixtures::repaired(Shape::rock, 800)),
          std::pair("terrain", fixtures::repaired(Shape::terrain, 800)),
          std::pair("cliff", fixtures::repaired(Shape::cliff, 800)),
          std::pair("vase", fixtures::repaired(Shape::vase, 800)), std::pair("debris", fixtures::grid_with_debris())}) {
        SCOPED_TRACE(name);
        equals_measuring_every_level(baked(mesh, *make_quadric_simplifier()));
    }
}

TEST(LevelDistance, DoesNotAskWhoMadeTheCollapses) {
    equals_measuring_every_level(baked(fixtures::repaired(Shape::rock, 800), *make_openmesh_simplifier()));
}

// A sheet over another one: what is near is not always what is joined.
TEST(LevelDistance, FindsTheOtherOfTwoSheets) {
    TriMesh sheets = fixtures::bumpy_grid(12, 12);
    const auto vertices = static_cast<uint32_t>(sheets.vertex_count());
    const size_t triangles = sheets.triangle_count();
    for (uint32_t v = 0; v < vertices; ++v) sheets.positions.push_back(sheets.positions[v] + glm::vec3(0, 0.003f, 0));
    for (size_t t = 0; t < triangles; ++t) {
        const Triangle& below = sheets.triangles[t];
        sheets.triangles.push_back({below[0] + vertices, below[1] + vertices, below[2] + vertices});
    }
    sheets.uvs.clear();
    sheets.normals.clear();
    sheets.set_identity_wedges();
    equals_measuring_every_level(baked(sheets, *make_quadric_simplifier()));
}

TEST(LevelDistance, ThreeTimesAsManyPointsFindHardlyMore) {
    for (const Shape shape : {Shape::rock, Shape::terrain, Shape::vase}) {
        const ProgressiveMesh pm = baked(fixtures::repaired(shape, 4000), *make_quadric_simplifier());
        LevelDistance few(pm, {100000, 1}), many(pm, {300000, 9});
        for (uint32_t level = 1; level < pm.levels(); ++level) {
            const double found = few.ecol(), there = many.ecol();
            ASSERT_LE(there, 1.05 * found + few.resolution()) << "level " << level << " of " << pm.levels();
        }
    }
}

}  // namespace
}  // namespace lodestone
