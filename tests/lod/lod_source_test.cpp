#include "lod/lod_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "frame/camera_path.h"
#include "frame/indexed_mesh.h"
#include "frame/plan_mirror.h"
#include "lod/bake.h"
#include "lod/cursor.h"
#include "mesh/generate.h"

namespace lodestone {
namespace {

// A rock whose errors are made up: level i is wrong by i / levels * 0.2.
std::shared_ptr<const ProgressiveMesh> rock(uint64_t triangles) {
    const TriMesh mesh = generate(Shape::rock, triangles, 4);
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    auto pm = bake_progressive_mesh(mesh, *list, {"static", "classic"});
    std::vector<float> errors(pm->levels());
    for (uint32_t i = 0; i < pm->levels(); ++i)
        errors[i] = 0.2f * static_cast<float>(i) / static_cast<float>(pm->levels());
    pm->set_errors(std::move(errors));
    return std::make_shared<const ProgressiveMesh>(std::move(*pm));
}

FrameInput input_at(float distance) {
    Camera camera;
    camera.eye = {0, 0, distance};
    camera.far_plane = 10000;
    FrameInput input;
    input.views = {view_of(camera, 640, 360), shadow_view({0, -1, -1}, {0, 0, 0}, 4, 512)};
    input.instances.resize(1);
    return input;
}

std::unique_ptr<FrameSource> open_one(std::shared_ptr<const ProgressiveMesh> pm, LodOptions options = {}) {
    auto source = open_lod({std::move(pm)}, options);
    EXPECT_TRUE(source) << source.error().message;
    return std::move(*source);
}

TEST(LodSource, DrawsExactlyTheFacesOfExtractInTheirOrder) {
    const auto pm = rock(3000);
    for (const std::string order : {"static", "classic"}) {
        const auto source = open_one(pm, {order});
        PlanMirror mirror(source->recipe());
        for (const float distance : {3.0f, 30.0f, 300.0f, 10.0f}) {
            const FrameInput input = input_at(distance);
            const Plan plan = source->plan(input);
            const auto done = mirror.execute(plan, input);
            ASSERT_TRUE(done) << done.error().message;
            const double error = error_under(input.views[0], bounding_sphere(pm->vertices), glm::mat4(1), 1);
            const TriMesh expected = extract_level(*pm, pm->level_for_error(error),
                                                   static_cast<uint32_t>(pm->order_named(order) - pm->orders.data()));
            const auto drawn = mirror.triangles_of(0);
            ASSERT_EQ(drawn.size(), expected.triangle_count());
            EXPECT_EQ(plan.stats.triangles, drawn.size());
            for (size_t t = 0; t < drawn.size(); ++t) {
                for (int k = 0; k < 3; ++k) ASSERT_EQ(drawn[t][static_cast<size_t>(k)], expected.position_of(t, k));
            }
        }
    }
}

TEST(LodSource, EqualInputsGiveEqualPlans) {
    const auto pm = rock(2000);
    const auto a = open_one(pm), b = open_one(pm);
    for (const float distance : {3.0f, 50.0f, 7.0f})
        EXPECT_EQ(hash_of_plan(a->plan(input_at(distance))), hash_of_plan(b->plan(input_at(distance))));
}

TEST(LodSource, UploadsNothingWhenTheLevelStays) {
    const auto source = open_one(rock(2000));
    source->plan(input_at(20));
    EXPECT_EQ(source->plan(input_at(20)).stats.uploaded_bytes, 0u);
}

TEST(LodSource, AForcedLevelIsDrawnWhateverTheError) {
    const auto pm = rock(2000);
    const auto source = open_one(pm);
    FrameInput input = input_at(1000);
    input.budget.forced_level = 0;
    EXPECT_EQ(source->plan(input).stats.triangles, pm->full_triangles());
    input.budget.forced_level = 1 << 30;
    EXPECT_EQ(source->plan(input).stats.triangles, pm->triangles_at(pm->levels() - 1));
}

TEST(LodSource, ATriangleBudgetIsKept) {
    const auto pm = rock(5000);
    const auto source = open_one(pm);
    FrameInput input = input_at(2);
    ASSERT_GT(source->plan(input).stats.triangles, 1000u);
    input.budget.max_triangles = 500;
    EXPECT_LE(source->plan(input).stats.triangles, 500u);
}

// 300 instances in motion: bytes stay within the budget, nobody is coarser than asked, and no draw reads what was not
// written.
TEST(LodSource, ManyInstancesInMotionStayWithinTheBudget) {
    const auto pm = rock(8000);
    LodOptions options;
    options.instances = 300;
    options.resident_bytes = pm->vertices.size_bytes() + 4 * pm->orders[0].indices.size_bytes();
    const auto source = open_one(pm, options);
    PlanMirror mirror(source->recipe());
    const Sphere sphere = bounding_sphere(pm->vertices);
    for (int frame = 0; frame < 12; ++frame) {
        FrameInput input = input_at(5);
        input.views.resize(1);
        input.frame = static_cast<uint64_t>(frame);
        input.instances.resize(300);
        for (int i = 0; i < 300; ++i) {
            const float z = -3.0f * static_cast<float>((i * 7 + frame * 11) % 300);
            input.instances[static_cast<size_t>(i)].object_to_world =
                glm::translate(glm::mat4(1), {0.1f * static_cast<float>(i % 5), 0, z});
        }
        const Plan plan = source->plan(input);
        const auto done = mirror.execute(plan, input);
        ASSERT_TRUE(done) << done.error().message;
        EXPECT_LE(plan.stats.resident_bytes, options.resident_bytes);
        EXPECT_LE(plan.stats.index_bytes, 4 * pm->orders[0].indices.size_bytes());
        for (uint32_t i = 0; i < 300; i += 17) {
            const double error = error_under(input.views[0], sphere, input.instances[i].object_to_world, 1);
            const uint32_t asked = pm->triangles_at(pm->level_for_error(error));
            const auto drawn = mirror.triangles_of(i).size();
            if (drawn == 0) continue;  // culled
            EXPECT_GE(drawn, asked) << "instance " << i;
            EXPECT_LE(drawn, 2.2 * asked + 300) << "instance " << i;
        }
        ASSERT_TRUE(source->validate());
    }
}

TEST(LodSource, FewInstancesEachHaveTheirOwnLevel) {
    const auto pm = rock(3000);
    LodOptions options;
    options.instances = 3;
    const auto source = open_one(pm, options);
    PlanMirror mirror(source->recipe());
    FrameInput input = input_at(4);
    input.instances.resize(3);
    for (int i = 0; i < 3; ++i)
        input.instances[static_cast<size_t>(i)].object_to_world =
            glm::translate(glm::mat4(1), {0, 0, -40.0f * static_cast<float>(i)});
    ASSERT_TRUE(mirror.execute(source->plan(input), input));
    for (uint32_t i = 0; i < 3; ++i) {
        const double error =
            error_under(input.views[0], bounding_sphere(pm->vertices), input.instances[i].object_to_world, 1);
        EXPECT_EQ(mirror.triangles_of(i).size(), pm->triangles_at(pm->level_for_error(error)));
    }
}

TEST(LodSource, ABudgetBelowOneIndexBufferDrawsCoarserAndSaysSo) {
    const auto pm = rock(5000);
    LodOptions options;
    options.resident_bytes = pm->vertices.size_bytes() + pm->orders[0].indices.size_bytes() / 4;
    const auto source = open_one(pm, options);
    FrameInput input = input_at(1.5f);
    input.budget.forced_level = 0;
    const Plan plan = source->plan(input);
    EXPECT_LT(plan.stats.triangles, pm->full_triangles() / 4 + 1);
    EXPECT_LE(plan.stats.resident_bytes, options.resident_bytes);
    EXPECT_EQ(plan.stats.more[0], (std::pair<std::string, double>("levels_out_of_reach", 1)));
    options.resident_bytes = 100;
    EXPECT_EQ(open_lod({pm}, options).error().fault, Fault::machine);
}

TEST(LodSource, AnOrderTheAssetLacksIsRefusedByName) {
    const auto refused = open_lod({rock(500)}, {"keyframe"});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("--order keyframe"));
}

// A slow zoom: every frame changes a few levels; what a GPU would see is what the cursor shows.
TEST(LodSource, ASlowZoomKeepsTheMirrorInStepWithTheCursor) {
    const auto pm = rock(4000);
    const auto source = open_one(pm);
    PlanMirror mirror(source->recipe());
    uint64_t uploaded = 0;
    for (int frame = 0; frame < 120; ++frame) {
        FrameInput input = input_at(3 + 0.25f * static_cast<float>(frame));
        const Plan plan = source->plan(input);
        ASSERT_TRUE(mirror.execute(plan, input));
        if (frame > 0) uploaded += plan.stats.uploaded_bytes;
        const double error = error_under(input.views[0], bounding_sphere(pm->vertices), glm::mat4(1), 1);
        ASSERT_EQ(mirror.triangles_of(0).size(), pm->triangles_at(pm->level_for_error(error)));
    }
    EXPECT_GT(uploaded, 0u);
}

}  // namespace
}  // namespace lodestone
