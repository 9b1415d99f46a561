// Limits of repair and of progressive meshes, made small.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/generate.h"
#include "mesh/repair.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

TEST(Limits, AreAsLargeAsTheNumbersThatTheyComeFrom) {
    const Limits limits;
    // Corners are numbered up to the mark; slots of both halves of an index buffer share 32 bits.
    EXPECT_LT(3 * limits.triangles, 0xffffffffu);
    EXPECT_GE(3 * (limits.triangles + 1), 0xffffffffu);
    const auto last = static_cast<uint32_t>(3 * limits.lod_triangles - 1);
    EXPECT_EQ(IndexSlot::of(1, last).position(), last);
    EXPECT_EQ(IndexSlot::of(1, last).half(), 1u);
    EXPECT_NE(IndexSlot::of(1, last + 3).position(), last + 3) << "one triangle more is not told from another";
}

TEST(Limits, ArePassedByNoMeshAndNamedWithTheNumber) {
    TriMesh mesh = generate(Shape::torus, 200, 1);
    const uint64_t triangles = mesh.triangle_count();
    RepairOptions options;
    options.limits.triangles = triangles;
    ASSERT_TRUE(repair(mesh, options));
    ASSERT_EQ(mesh.triangle_count(), triangles);
    options.limits.triangles = triangles - 1;
    const auto repaired = repair(mesh, options);
    ASSERT_FALSE(repaired);
    const std::string sentence =
        "has " + std::to_string(triangles) + " triangles; the limit is " + std::to_string(triangles - 1);
    EXPECT_THAT(repaired.error().message, HasSubstr(sentence));

    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    ASSERT_TRUE(list);
    Limits limits;
    limits.lod_triangles = triangles;
    EXPECT_TRUE(bake_progressive_mesh(mesh, *list, {"keyframe"}, {}, {}, limits));
    limits.lod_triangles = triangles - 1;
    const auto baked = bake_progressive_mesh(mesh, *list, {"keyframe"}, {}, {}, limits);
    ASSERT_FALSE(baked);
    EXPECT_THAT(baked.error().message, HasSubstr(sentence));
    limits.lod_triangles = triangles;
    limits.lod_entries = 10;
    const auto entries = bake_progressive_mesh(mesh, *list, {"keyframe"}, {}, {}, limits);
    ASSERT_FALSE(entries);
    EXPECT_THAT(entries.error().message, HasSubstr("; the limit is 10"));
}

}  // namespace
}  // namespace lodestone
