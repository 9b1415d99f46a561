#include "lod/draw/lod_source.h"
#include "lod/asset/vertex_places.h"
#include "lod/bake/simplify/simplifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "frame/camera_path.h"
#include "frame/indexed_mesh.h"
#include "frame/plan_mirror.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/draw/morphed_vertex.h"
#include "mesh/generate.h"
#include "shaders/shared/lod_morph.h"

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
        const auto source = open_one(pm, {.order = order, .steady_share = 1});
        PlanMirror mirror(source->recipe());
        for (const float distance : {3.0f, 30.0f, 300.0f, 10.0f}) {
            const FrameInput input = input_at(distance);
            const Plan plan = source->plan(input);
            const auto done = mirror.execute(plan, input);
            ASSERT_TRUE(done) << done.error().message;
            const double error = error_under(input.views[0], bounding_sphere(pm->vertices), glm::mat4(1), 1);
            const TriMesh expected = *extract_level(*pm, pm->level_for_error(error),
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

TEST(LodSource, AnUploadBudgetIsKeptAndTheLevelIsReachedInMoreFrames) {
    const auto pm = rock(20000);
    for (const bool geomorph : {false, true}) {
        const auto source = open_one(pm, {.steady_share = 1, .geomorph = geomorph});
        PlanMirror mirror(source->recipe(), {morphed_vertex, {}});
        constexpr uint64_t upload_bytes = 200000;
        uint64_t triangles = 0, waited = 0;
        for (uint64_t frame = 0; frame < 200; ++frame) {
            FrameInput input = input_at(frame < 80 ? 60.0f : 2.0f);
            input.frame = frame;
            input.budget.upload_bytes = upload_bytes;
            const Plan plan = source->plan(input);
            const auto done = mirror.execute(plan, input);
            ASSERT_TRUE(done) << frame << ": " << done.error().message;
            if (frame > 0) { EXPECT_LE(plan.stats.uploaded_bytes, upload_bytes) << frame; }
            waited += frame > 0 && plan.stats.triangles != triangles;
            triangles = plan.stats.triangles;
            ASSERT_EQ(mirror.triangles_of(0).size(), triangles);
        }
        EXPECT_GT(waited, 10u) << "it never had to wait";
        const auto unlimited = open_one(pm, {.steady_share = 1, .geomorph = geomorph});
        EXPECT_EQ(unlimited->plan(input_at(2)).stats.triangles, triangles);
    }
}

// 300 instances in motion: bytes stay within the budget, nobody is coarser than asked or much finer, and no draw reads
// what was not written. multiple: of the index buffer of full detail, that cursors may take.
void expect_many_within_budget(const std::shared_ptr<const ProgressiveMesh>& pm, uint64_t multiple) {
    LodOptions options;
    options.instances = 300;
    options.steady_share = 1;
    options.resident_bytes = pm->vertices.size_bytes() + multiple * pm->orders[0].indices.size_bytes();
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
            input.instances.edit(static_cast<size_t>(i)).object_to_world =
                glm::translate(glm::mat4(1), {0.1f * static_cast<float>(i % 5), 0, z});
        }
        const Plan plan = source->plan(input);
        const auto done = mirror.execute(plan, input);
        ASSERT_TRUE(done) << done.error().message;
        EXPECT_LE(plan.stats.resident_bytes, options.resident_bytes);
        EXPECT_LE(plan.stats.index_bytes, multiple * pm->orders[0].indices.size_bytes());
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

TEST(LodSource, ManyInstancesInMotionStayWithinTheBudget) {
    expect_many_within_budget(rock(8000), 4);
    // With room for cursors so near to each other that they would not reach down to what is far away.
    expect_many_within_budget(rock(30000), 60);
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
        input.instances.edit(static_cast<size_t>(i)).object_to_world =
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
    const auto source = open_one(pm, {.steady_share = 1});
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

// Views that tremble by less than what levels may be finer change nothing; those that go on are followed, and no level
// is ever coarser than asked for, or finer by more.
TEST(LodSource, ALevelStaysWhileItIsGoodEnough) {
    const auto pm = rock(4000);
    const auto source = open_one(pm, {.steady_share = 0.9});
    const Sphere sphere = bounding_sphere(pm->vertices);
    const auto at = [&](float distance) {
        const FrameInput input = input_at(distance);
        const Plan plan = source->plan(input);
        const double error = error_under(input.views[0], sphere, glm::mat4(1), 1);
        EXPECT_GE(plan.stats.triangles, pm->triangles_at(pm->level_for_error(error)));
        EXPECT_LE(plan.stats.triangles, pm->triangles_at(pm->level_for_error(0.9 * error)));
        return plan.stats.uploaded_bytes;
    };
    at(20);
    at(19.5f);
    for (int i = 0; i < 20; ++i) EXPECT_EQ(at(i % 2 == 0 ? 20.4f : 19.6f), 0u);
    uint64_t uploaded = 0;
    for (const float distance : {22.0f, 30.0f, 40.0f, 25.0f, 10.0f}) uploaded += at(distance);
    EXPECT_GT(uploaded, 0u);
}

// What is drawn where wedge 0 .. n of full detail are: itself while it lasts, and then what it became.
std::vector<glm::vec3> drawn_places(const ProgressiveMesh& pm, const PlanMirror& mirror, uint32_t level) {
    const PlanMirror::MirroredDraw& draw = mirror.draws().back();
    const uint32_t wedges = pm.wedges_at(level);
    const std::vector<uint32_t> at = vertex_places(pm, 0);
    std::vector<glm::vec3> places;
    for (uint32_t w = 0; w < pm.wedges_at(0); ++w) {
        uint32_t alive = w;
        while (alive >= wedges) alive = pm.parents[pm.wedges_at(0) - 1 - alive];
        places.push_back(morphed_vertex(mirror, draw.draw, {}, 0, at[alive]));
    }
    return places;
}

TEST(LodSource, NothingPopsWhereVerticesMorph) {
    const auto pm = rock(6000);
    const auto source = open_one(pm, {.steady_share = 1, .geomorph = true, .morphing_share = 0.125});
    PlanMirror mirror(source->recipe(), {morphed_vertex, {}});
    std::vector<glm::vec3> before;
    uint32_t level_before = 0;
    double most_morphed = 0, most_popped = 0;
    size_t went = 0;
    for (int frame = 0; frame < 60; ++frame) {
        const FrameInput input = input_at(20 + 0.02f * static_cast<float>(frame));
        const Plan plan = source->plan(input);
        const auto done = mirror.execute(plan, input);
        ASSERT_TRUE(done) << done.error().message;
        const auto& words = mirror.draws().back().draw.words;
        const double error = error_under(input.views[0], bounding_sphere(pm->vertices), glm::mat4(1), 1);
        const uint32_t asked = pm->level_for_error(error), level = words[0];
        EXPECT_EQ(words[LODE_LOD_WORD_STAYING], pm->wedges_at(asked));
        EXPECT_EQ(words[LODE_LOD_WORD_ARRIVED], pm->wedges_at(level));
        EXPECT_LT(level, asked);
        // Those that stay are where they belong.
        const std::vector<glm::vec3> places = drawn_places(*pm, mirror, level);
        for (uint32_t w = 0; w < pm->wedges_at(asked); ++w) {
            const auto& p = pm->vertices[w].position;
            ASSERT_EQ(places[w], glm::vec3(p[0], p[1], p[2]));
        }
        for (size_t w = 0; w < before.size(); ++w)
            most_morphed = std::max(most_morphed, static_cast<double>(glm::distance(before[w], places[w])));
        if (!before.empty()) {
            went += pm->wedges_at(level_before) - pm->wedges_at(level);
            for (uint32_t w = pm->wedges_at(level); w < pm->wedges_at(level_before); ++w) {
                const auto &from = pm->vertices[w].position,
                           &to = pm->vertices[pm->parents[pm->wedges_at(0) - 1 - w]].position;
                most_popped = std::max<double>(
                    most_popped, glm::distance(glm::vec3(from[0], from[1], from[2]), glm::vec3(to[0], to[1], to[2])));
            }
        }
        before = places;
        level_before = level;
    }
    EXPECT_GT(went, 30u);
    EXPECT_LT(most_morphed, most_popped / 4);
    // Looked at from elsewhere, levels are as chosen and nothing morphs; a forced level is just that.
    FrameInput input = input_at(20);
    input.level_view = input.views[0];
    ASSERT_TRUE(mirror.execute(source->plan(input), input));
    const auto& frozen = mirror.draws().back().draw.words;
    EXPECT_EQ(frozen[LODE_LOD_WORD_STAYING], pm->wedges_at(frozen[0]));
    input.budget.forced_level = 100;
    EXPECT_EQ(source->plan(input).stats.triangles, pm->triangles_at(100));
}

}  // namespace
}  // namespace lodestone
