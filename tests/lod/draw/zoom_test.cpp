#include "lod/draw/zoom.h"

#include <gtest/gtest.h>

#include "fixtures/meshes.h"
#include "lod/bake/bake.h"
#include "lod/bake/error_curve.h"
#include "lod/bake/simplify/simplifier.h"

namespace lodestone {
namespace {

// As bakes make them, with measured errors.
std::shared_ptr<const ProgressiveMesh> baked(Shape shape, size_t triangles) {
    const TriMesh mesh = fixtures::repaired(shape, triangles);
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    auto pm = bake_progressive_mesh(mesh, *list, {"static"});
    pm->set_errors(*measure_errors(*pm));
    return std::make_shared<const ProgressiveMesh>(std::move(*pm));
}

class Zoom : public testing::TestWithParam<Shape> {};

TEST_P(Zoom, ChangesTheLevelInMostFramesAndByFewTriangles) {
    const ZoomFigures f = zoom_on(baked(GetParam(), 20000), {});
    EXPECT_GE(f.changed, f.frames / 2) << f.first_triangles << " to " << f.last_triangles << " triangles";
    EXPECT_LE(f.most_changed, 0.03);
}

TEST_P(Zoom, NoWedgeJumpsWhereVerticesMorph) {
    const auto pm = baked(GetParam(), 10000);
    ZoomOptions options;
    options.nearest = 5;  // so that full detail is not drawn
    const ZoomFigures morphed = zoom_on(pm, {.geomorph = true}, options);
    EXPECT_GE(morphed.changed, morphed.frames / 3);
    EXPECT_LE(morphed.farthest, 1);
    // Without, vertices jump, and the wider the window, the shorter the way.
    EXPECT_GT(zoom_on(pm, {}, options).farthest, 4 * morphed.farthest);
    EXPECT_GT(zoom_on(pm, {.geomorph = true, .morphing_share = 0.05}, options).farthest, morphed.farthest);
}

INSTANTIATE_TEST_SUITE_P(Shapes, Zoom, testing::Values(Shape::rock, Shape::terrain, Shape::torus));

}  // namespace
}  // namespace lodestone
