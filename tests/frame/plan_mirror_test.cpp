#include "frame/plan_mirror.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frame/indexed_mesh.h"
#include "shaders/shared/mesh_vertex.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

// One triangle in a vertex and an index buffer, drawn in one camera view.
struct OneTriangle {
    Recipe recipe;
    Plan plan;
    FrameInput input;

    OneTriangle() {
        recipe.buffers = {{"vertices", 3 * sizeof(MeshVertex), use_vertex, 4}, {"indices", 24, use_index, 4}};
        recipe.pipelines = {indexed_mesh_pipeline()};
        std::vector<MeshVertex> vertices(3);
        vertices[1].position[0] = vertices[2].position[1] = 1;
        const std::vector<uint32_t> indices = {0, 1, 2, 0, 0, 1};
        input.views = {view_of(Camera{}, 64, 64)};
        input.instances.resize(1);
        plan.commands.push_back({Stage::update, Upload{0, 0, Blob::copy_of(vertices.data(), vertices.size())}});
        plan.commands.push_back({Stage::update, Upload{1, 0, Blob::copy_of(indices.data(), indices.size())}});
        IndexedRange range;
        range.index_buffer = 1;
        range.index_count = 6;
        range.triangles = 1;
        range.instances = {{0, 1}};
        draw_ranges(plan, input, {&range, 1});
    }
    Draw& draw(size_t command) { return std::get<Draw>(plan.commands[command].what); }
    std::string fault() const {
        const auto done = PlanMirror(recipe).execute(plan, input);
        return done ? "" : done.error().message;
    }
};

TEST(PlanMirror, AcceptsAGoodPlanAndTellsWhatIsDrawn) {
    OneTriangle one;
    PlanMirror mirror(one.recipe);
    const auto done = mirror.execute(one.plan, one.input);
    ASSERT_TRUE(done) << done.error().message;
    ASSERT_EQ(mirror.draws().size(), 2u);  // depth and colour
    EXPECT_THAT(mirror.draws()[0].indices, testing::ElementsAre(0, 1, 2, 0, 0, 1));
    ASSERT_EQ(mirror.triangles_of(0).size(), 1u);
    EXPECT_EQ(mirror.triangles_of(0)[0][1], glm::vec3(1, 0, 0));
    EXPECT_EQ(one.plan.stats.triangles, 1u);
    EXPECT_EQ(one.plan.stats.instances_drawn, 1u);
}

TEST(PlanMirror, AnUploadOfNothingIsNothing) {
    OneTriangle one;
    one.plan.commands.push_back({Stage::update, Upload{0, 0, Blob()}});
    EXPECT_EQ(one.fault(), "");
}

TEST(PlanMirror, TheIndexBufferOfAnIndirectDrawMustBeThere) {
    OneTriangle one;
    const auto records = static_cast<uint32_t>(one.recipe.buffers.size());
    one.recipe.buffers.push_back({"records", 40, use_storage | use_indirect, 4});
    for (Command& command : one.plan.commands) {
        if (const auto* draw = std::get_if<Draw>(&command.what)) {
            DrawIndirect indirect{*draw, records};
            indirect.draw.index_buffer = 99;
            command.what = indirect;
        }
    }
    EXPECT_THAT(one.fault(), HasSubstr("99"));
}

TEST(PlanMirror, TellsIndirectDrawsOnceItHasLearntWhatTheDeviceWrote) {
    OneTriangle one;
    const auto records = static_cast<uint32_t>(one.recipe.buffers.size());
    one.recipe.buffers.push_back({"records", 40, use_storage | use_indirect, 4});
    PipelineSpec pass;
    pass.kind = PipelineKind::compute;
    pass.compute = "some/pass.comp";
    pass.storage = {{0, records, Access::write}};
    const auto number = static_cast<uint32_t>(one.recipe.pipelines.size());
    one.recipe.pipelines.push_back(pass);
    DrawIndirect indirect;
    for (Command& command : one.plan.commands) {
        if (const auto* draw = std::get_if<Draw>(&command.what)) {
            indirect.draw = *draw;
            indirect.arguments = records;
            indirect.draws = 2;
            command.what = indirect;
        }
    }
    Dispatch dispatch;
    dispatch.pipeline = number;
    one.plan.commands.push_back({Stage::update, dispatch});
    PlanMirror mirror(one.recipe);
    const auto done = mirror.execute(one.plan, one.input);
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_TRUE(mirror.draws().empty()) << "nobody knows yet what is drawn";
    EXPECT_THAT(mirror.computed_for_draws(one.plan), testing::ElementsAre(records));
    // The second half of the indices, and a record that draws nothing.
    const std::array<uint32_t, 10> written{3, 1, 3, 0, 0, 0, 1, 0, 0, 0};
    mirror.learn(records, std::as_bytes(std::span(written)));
    ASSERT_EQ(mirror.draws().size(), 2u);  // depth and colour
    EXPECT_THAT(mirror.draws()[0].indices, testing::ElementsAre(0, 0, 1));
    EXPECT_EQ(mirror.draws()[0].draw.count, 3u);
    ASSERT_TRUE(mirror.execute(one.plan, one.input));
    EXPECT_TRUE(mirror.draws().empty()) << "of another frame";
}

// A pass whose groups come from a buffer that it writes itself.
struct OneDispatch {
    Recipe recipe;
    Plan plan;
    FrameInput input;

    OneDispatch() {
        recipe.buffers = {{"arguments", 24, use_storage | use_indirect, 4}};
        PipelineSpec pass;
        pass.kind = PipelineKind::compute;
        pass.compute = "some/pass.comp";
        pass.storage = {{0, 0, Access::read_write}};
        recipe.pipelines = {pass};
        input.views = {view_of(Camera{}, 64, 64)};
        const std::array<uint32_t, 3> groups{5, 1, 1};
        Dispatch first;
        first.arguments = 0;
        Dispatch second = first;
        second.offset = 12;
        plan.commands = {{Stage::update, Upload{0, 0, Blob::copy_of(groups.data(), groups.size())}},
                         {Stage::update, first},
                         {Stage::update, second}};
    }
    Dispatch& first() { return std::get<Dispatch>(plan.commands[1].what); }
    std::string fault() const {
        const auto done = PlanMirror(recipe).execute(plan, input);
        return done ? "" : done.error().message;
    }
};

TEST(PlanMirror, AcceptsADispatchWhoseGroupsTheDeviceWrites) { EXPECT_EQ(OneDispatch().fault(), ""); }

TEST(PlanMirror, NamesADispatchWhoseGroupsNothingHasWritten) {
    OneDispatch one;
    one.first().offset = 4;
    EXPECT_THAT(one.fault(), HasSubstr("byte 12 of buffer 'arguments' is read before anything was written"));
}

TEST(PlanMirror, NamesADispatchWhoseGroupsLieOutsideTheirBuffer) {
    OneDispatch one;
    one.first().offset = 16;
    EXPECT_THAT(one.fault(), HasSubstr("outside buffer 'arguments'"));
}

TEST(PlanMirror, NamesADispatchWhoseGroupsComeFromABufferNotMadeForThat) {
    OneDispatch one;
    one.recipe.buffers[0].use = use_storage;
    EXPECT_THAT(one.fault(), HasSubstr("not made for this use"));
}

TEST(PlanMirror, NamesADispatchOfMoreGroupsThanDevicesTake) {
    OneDispatch one;
    one.first().arguments = no_buffer;
    one.first().groups = {1, 65536, 1};
    EXPECT_THAT(one.fault(), HasSubstr("more groups"));
}

TEST(PlanMirror, PlansDifferWhereTheirDispatchesGroupsComeFromOtherPlaces) {
    OneDispatch one, other;
    EXPECT_EQ(hash_of_plan(one.plan), hash_of_plan(other.plan));
    other.first().offset = 12;
    EXPECT_NE(one.plan, other.plan);
    EXPECT_NE(hash_of_plan(one.plan), hash_of_plan(other.plan));
    EXPECT_THAT(dump(other.plan), HasSubstr("groups of buffer 0+12"));
}

TEST(PlanMirror, NamesAnUploadOutsideItsBuffer) {
    OneTriangle one;
    std::get<Upload>(one.plan.commands[1].what).offset = 4;
    EXPECT_THAT(one.fault(), HasSubstr("outside buffer 'indices'"));
}

TEST(PlanMirror, NamesAnUploadOutsideTheUpdateStage) {
    OneTriangle one;
    one.plan.commands[1].stage = Stage::shadow;
    EXPECT_THAT(one.fault(), HasSubstr("outside the update stage"));
}

TEST(PlanMirror, NamesIndicesThatNothingHasWritten) {
    OneTriangle one;
    one.plan.commands.erase(one.plan.commands.begin() + 1);
    EXPECT_THAT(one.fault(), HasSubstr("before anything was written"));
}

TEST(PlanMirror, NamesAnIndexPastTheVertices) {
    OneTriangle one;
    const std::vector<uint32_t> indices = {0, 1, 3, 0, 0, 1};
    one.plan.commands[1].what = Upload{1, 0, Blob::copy_of(indices.data(), indices.size())};
    EXPECT_THAT(one.fault(), HasSubstr("index 3 lies past"));
}

TEST(PlanMirror, NamesADrawOfAViewThatIsNotThere) {
    OneTriangle one;
    one.draw(2).view = 1;
    EXPECT_THAT(one.fault(), HasSubstr("view 1"));
}

TEST(PlanMirror, NamesACameraViewDrawnInTheShadowStage) {
    OneTriangle one;
    one.plan.commands[2].stage = Stage::shadow;
    EXPECT_THAT(one.fault(), HasSubstr("other kind"));
}

TEST(PlanMirror, NamesABufferUsedForWhatItIsNotMadeFor) {
    OneTriangle one;
    one.draw(2).index_buffer = 0;
    EXPECT_THAT(one.fault(), HasSubstr("not made for this use"));
}

TEST(PlanMirror, NamesAPipelineInAStageThatItIsNotMadeFor) {
    OneTriangle one;
    one.recipe.pipelines[0].visibility = "a/visible.frag";
    EXPECT_THAT(one.fault(), HasSubstr("too late"));
    OneTriangle other;
    other.recipe.pipelines[0].whole_view = true;
    EXPECT_THAT(other.fault(), HasSubstr("covers the view"));
}

// An effect: laid over the view in the composite stage, and nowhere else.
TEST(PlanMirror, NamesWhatBlendsOutsideTheCompositeStage) {
    OneTriangle over;
    PipelineSpec& pipeline = over.recipe.pipelines[0];
    pipeline.layout = {};
    pipeline.whole_view = true;
    pipeline.blend = Blend::over;
    Draw draw;
    draw.count = 3;
    const auto fault_in = [&](Stage stage) {
        over.plan.commands = {{stage, draw}};
        return over.fault();
    };
    EXPECT_EQ(fault_in(Stage::composite), "");
    EXPECT_THAT(fault_in(Stage::colour), HasSubstr("what blends belongs into the composite stage"));
    EXPECT_THAT(fault_in(Stage::effect), HasSubstr("a draw stands in the effect stage"));
    over.recipe.pipelines[0].blend = Blend::replace;
    EXPECT_EQ(fault_in(Stage::colour), "");
    EXPECT_THAT(fault_in(Stage::composite), HasSubstr("there only what blends is drawn"));
    over.recipe.pipelines[0].blend = Blend::over;
    over.recipe.pipelines[0].whole_view = false;
    EXPECT_THAT(fault_in(Stage::composite), HasSubstr("does not cover the view"));
}

TEST(PlanMirror, NamesAPlanOfAnotherGeneration) {
    OneTriangle one;
    one.plan.generation = 1;
    EXPECT_THAT(one.fault(), HasSubstr("generation"));
}

TEST(PlanMirror, FollowsCopies) {
    OneTriangle one;
    one.recipe.buffers.push_back({"spare", 24, use_index, 4});
    one.plan.commands.insert(one.plan.commands.begin() + 2, {Stage::update, Copy{1, 2, 0, 12, 12}});
    PlanMirror mirror(one.recipe);
    ASSERT_TRUE(mirror.execute(one.plan, one.input));
    EXPECT_EQ(mirror.buffer(2)[16], std::byte{1});
}

TEST(PlanMirror, KeepsWhatAChangeOfSizeKeeps) {
    OneTriangle one;
    one.recipe.buffers[1].most_bytes = 48;
    PlanMirror mirror(one.recipe);
    ASSERT_TRUE(mirror.execute(one.plan, one.input));
    // The second triangle is drawn where the indices had been 24 bytes, of which the first 12 are kept.
    const auto resized = [&](const Resize& resize, uint64_t first) {
        one.plan.commands.erase(one.plan.commands.begin(), one.plan.commands.end() - 2);
        one.draw(0).index_offset = one.draw(1).index_offset = first;
        one.draw(0).count = one.draw(1).count = 3;
        one.plan.commands.insert(one.plan.commands.begin(), {Stage::update, resize});
        const auto done = mirror.execute(one.plan, one.input);
        return done ? "" : done.error().message;
    };
    EXPECT_EQ(resized({1, 48, 12}, 0), "");
    EXPECT_EQ(mirror.recipe().buffers[1].bytes, 48u);
    EXPECT_THAT(mirror.draws()[0].indices, testing::ElementsAre(0, 1, 2));
    EXPECT_THAT(resized({1, 36, 12}, 12), HasSubstr("before anything was written"));
    EXPECT_THAT(resized({1, 52, 12}, 0), HasSubstr("cannot have 52 bytes"));
    EXPECT_THAT(resized({1, 8, 12}, 0), HasSubstr("more than it then has"));
    EXPECT_THAT(resized({0, 96, 0}, 0), HasSubstr("'vertices' cannot have 96 bytes"));
}

TEST(Plan, EqualPlansHaveEqualHashesAndDifferentOnesDiffer) {
    const OneTriangle a, b;
    EXPECT_EQ(a.plan, b.plan);
    EXPECT_EQ(hash_of_plan(a.plan), hash_of_plan(b.plan));
    OneTriangle c;
    c.draw(3).words[5] = 1;
    EXPECT_NE(hash_of_plan(a.plan), hash_of_plan(c.plan));
}

TEST(DrawRanges, CullsPerViewAndDrawsShadowsOfWhatTheCameraDoesNotSee) {
    OneTriangle one;
    FrameInput input = one.input;
    input.instances.edit(0).object_to_world[3] = {0, 0, 50, 1};  // behind the camera
    input.views.push_back(shadow_view({0, -1, 0}, {0, 0, 0}, 100, 64));
    IndexedRange range;
    range.index_buffer = 1;
    range.index_count = 6;
    InstanceTree tree(std::vector<Sphere>{{{0, 0, 0}, 2}});
    tree.update(input.instances);
    range.instances = seen_instances(tree, input.views);
    Plan plan;
    draw_ranges(plan, input, {&range, 1});
    ASSERT_EQ(plan.commands.size(), 1u);
    EXPECT_EQ(plan.commands[0].stage, Stage::shadow);
    EXPECT_EQ(plan.stats.instances_culled, 1u);
}

}  // namespace
}  // namespace lodestone
