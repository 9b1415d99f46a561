// Limits of repair and of progressive meshes, made small.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/none.h"
#include "lod/asset/split_mesh.h"
#include "lod/bake/bake.h"
#include "lod/bake/simplify/simplifier.h"
#include "mesh/generate.h"
#include "mesh/repair.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

TEST(Limits, AreAsLargeAsTheNumbersThatTheyComeFrom) {
    const Limits limits;
    // Corners are numbered up to the mark, everywhere alike.
    EXPECT_LT(3 * limits.triangles, 0xffffffffu);
    EXPECT_GE(3 * (limits.triangles + 1), 0xffffffffu);
    EXPECT_LE(3 * limits.triangles, limits.lod_indices);
    const SplitMesh::Corner last{static_cast<uint32_t>(limits.triangles - 1), 2};
    EXPECT_LT(last.code(), none);
    EXPECT_EQ(SplitMesh::Corner::of(last.code()), last);
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
    limits.triangles = triangles;
    EXPECT_TRUE(bake_progressive_mesh(mesh, *list, {"keyframe"}, {}, {}, limits));
    limits.triangles = triangles - 1;
    const auto baked = bake_progressive_mesh(mesh, *list, {"keyframe"}, {}, {}, limits);
    ASSERT_FALSE(baked);
    EXPECT_THAT(baked.error().message, HasSubstr(sentence));
    limits.triangles = triangles;
    limits.lod_entries = 10;
    const auto entries = bake_progressive_mesh(mesh, *list, {"greedy"}, {}, {}, limits);
    ASSERT_FALSE(entries);
    EXPECT_THAT(entries.error().message, HasSubstr("; the limit is 10"));
}

// A mesh may fill the first half of the index buffer; what the second half has no room for comes later.
TEST(Limits, LetNewOrdersComeWhereTheIndexBufferHasRoom) {
    const TriMesh mesh = generate(Shape::rock, 3000, 1);
    const uint64_t triangles = mesh.triangle_count();
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    ASSERT_TRUE(list);
    const std::vector<std::string> names = {"keyframe", "static", "classic", "greedy"};
    const auto all = bake_progressive_mesh(mesh, *list, names);
    ASSERT_TRUE(all);
    ASSERT_GT(all->orders[0].slots_of(1), triangles / 2);
    for (const uint64_t room : {triangles / 3, uint64_t{40}, uint64_t{0}}) {
        SCOPED_TRACE(room);
        Limits limits;
        limits.lod_indices = 3 * (triangles + room);
        const auto pm = bake_progressive_mesh(mesh, *list, names, {}, {}, limits);
        ASSERT_TRUE(pm);
        EXPECT_EQ(pm->levels(), all->levels());
        for (const FaceOrder& order : pm->orders) {
            const uint32_t second_half = order.keyframes.empty() ? 0 : order.slots_of(1);
            EXPECT_LE(second_half, room) << order.name;
            // With room for any, there are some.
            const bool changes_by_keyframes = order.name == "keyframe" || order.name == "static";
            EXPECT_EQ(second_half > 0, changes_by_keyframes && room > 0) << order.name;
        }
        const auto good = pm->validate();
        EXPECT_TRUE(good) << good.error().message;
    }
}

}  // namespace
}  // namespace lodestone
