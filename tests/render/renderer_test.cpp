// The renderer on whatever device is there; Mesa's software rasteriser will do. Validation must stay silent throughout.
#include "render/renderer.h"
#include "lod/bake/simplify/simplifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <filesystem>
#include <numeric>

#include "baseline/discrete.h"
#include "baseline/fixed_levels.h"
#include "baseline/full.h"
#include "fixtures/meshes.h"
#include "frame/indexed_mesh.h"
#include "frame/plan_mirror.h"
#include "lod/bake/bake.h"
#include "lod/draw/lod_source.h"
#include "lod/draw/morphed_vertex.h"
#include "mesh/generate.h"
#include "mesh/io/image_file.h"
#include "mesh/packed_vertices.h"
#include "mesh/repair.h"
#include "render/device_test.h"
#include "shaders/shared/lod_morph.h"

namespace lodestone {

void add_test_shaders();  // generated from tests/render/shaders

namespace {

constexpr uint32_t width = 160, height = 120;

class RendererTest : public DeviceTest {
protected:
    RendererTest() : DeviceTest(width, height) {
        static const bool added = (add_test_shaders(), true);
        static_cast<void>(added);
    }
};

FrameInput look_at(const glm::vec3& eye, uint64_t frame, std::vector<Instance> instances = {Instance{}}) {
    Camera camera;
    camera.eye = eye;
    camera.near_plane = 0.05f;
    FrameInput input;
    input.views = {view_of(camera, width, height), shadow_view(ShadingOptions{}.light_direction, {0, 0, 0}, 3, 512)};
    input.instances = std::move(instances);
    input.frame = frame;
    return input;
}

std::shared_ptr<const ProgressiveMesh> baked(const TriMesh& mesh) {
    auto list = make_quadric_simplifier()->simplify(mesh, {});
    auto pm = bake_progressive_mesh(mesh, *list, {"static"});
    std::vector<float> errors(pm->levels());
    for (size_t l = 0; l < errors.size(); ++l)
        errors[l] = 0.1f * static_cast<float>(l) / static_cast<float>(errors.size());
    pm->set_errors(errors);
    return std::make_shared<const ProgressiveMesh>(std::move(*pm));
}

TriMesh rock(size_t triangles) {
    TriMesh mesh = generate(Shape::rock, triangles, 1);
    EXPECT_TRUE(repair(mesh));
    return mesh;
}

std::unique_ptr<FrameSource> lod_of(const TriMesh& mesh, uint32_t instances = 1) {
    auto source = open_lod({baked(mesh)}, {"static", uint64_t{1} << 30, instances});
    EXPECT_TRUE(source);
    return std::move(*source);
}

std::unique_ptr<FrameSource> full_of(const TriMesh& mesh) {
    std::vector<uint32_t> indices;
    for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    auto source = open_fixed_levels({full_level(pack_vertices(mesh), indices)}, uint64_t{1} << 30);
    EXPECT_TRUE(source);
    return std::move(*source);
}

MaterialSet plain_materials() { return {{Material{}}, {}}; }

Picture drawn(Renderer& renderer, FrameSource& source, const FrameInput& input, const ShadingOptions& look = {}) {
    const auto submitted = renderer.submit(source.plan(input), input, look);
    EXPECT_TRUE(submitted) << submitted.error().message;
    auto picture = renderer.read_picture();
    EXPECT_TRUE(picture) << picture.error().message;
    return std::move(*picture);
}

size_t covered(const Picture& picture) {
    size_t count = 0;
    for (size_t i = 3; i < picture.colour.size(); i += 4) count += picture.colour[i] > 0 ? 1 : 0;
    return count;
}

double psnr(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum > 0 ? 10 * std::log10(255.0 * 255.0 * static_cast<double>(a.size()) / sum) : 100;
}

// Compares with tests/render/golden/NAME.png; LODESTONE_UPDATE_GOLDEN=1 writes it. Devices may differ in a few pixels
// of edges.
void expect_golden(const Picture& picture, const std::string& name) {
    const std::filesystem::path path =
        std::filesystem::path(LODESTONE_SOURCE_DIR) / "tests/render/golden" / (name + ".png");
    Image image{picture.width, picture.height, {}};
    for (size_t i = 0; i < picture.colour.size(); i += 4)
        image.texels.emplace_back(picture.colour[i], picture.colour[i + 1], picture.colour[i + 2],
                                  picture.colour[i + 3]);
    if (std::getenv("LODESTONE_UPDATE_GOLDEN") != nullptr) { ASSERT_TRUE(write_png(image, path)); }
    const auto golden = read_image(path);
    ASSERT_TRUE(golden) << golden.error().message;
    ASSERT_EQ(golden->texels.size(), image.texels.size());
    std::vector<uint8_t> expected;
    for (const auto& t : golden->texels) expected.insert(expected.end(), {t.x, t.y, t.z, t.w});
    EXPECT_GT(psnr(picture.colour, expected), 38) << name;
}

TEST_F(RendererTest, DrawsTheGoldenPictures) {
    Renderer& renderer = make();
    const TriMesh mesh = rock(3000);
    auto full = full_of(mesh);
    ASSERT_TRUE(renderer.load(full->recipe(), plain_materials()));
    expect_golden(drawn(renderer, *full, look_at({0, 0.6f, 3}, 0)), "rock");
    ShadingOptions look;
    look.debug = DebugView::normal;
    expect_golden(drawn(renderer, *full, look_at({0, 0.6f, 3}, 1), look), "rock-normals");

    // A quarter of the texture on each side of a cube, vertex colours over it, and a shadow.
    TriMesh cube = fixtures::cube_with_seams();
    for (uint32_t w = 0; w < cube.wedge_count(); ++w) cube.colours.emplace_back(255, w % 2 != 0 ? 255 : 128, 255, 255);
    auto textured = full_of(cube);
    MaterialSet materials{{Material{}}, {{4, 4, {}}}};
    materials.materials[0].base_colour_texture.image = 0;
    for (uint32_t i = 0; i < 16; ++i)
        materials.images[0].texels.emplace_back((i % 4 + i / 4) % 2 != 0 ? glm::u8vec4(230, 60, 40, 255)
                                                                         : glm::u8vec4(240, 240, 240, 255));
    ASSERT_TRUE(renderer.load(textured->recipe(), materials));
    Instance small;
    small.object_to_world = glm::mat4(0.5f);
    small.object_to_world[3] = glm::vec4(-0.7f, 1.2f, 0, 1);
    expect_golden(drawn(renderer, *textured, look_at({2, 1.6f, 3}, 2, {Instance{}, small})), "cubes");
}

TEST_F(RendererTest, ColoursTrianglesByTheirMarks) {
    Renderer& renderer = make();
    auto full = full_of(rock(3000));
    ASSERT_TRUE(renderer.load(full->recipe(), plain_materials()));
    const Plan plan = full->plan(look_at({0, 0, 3}, 0));
    PlanMirror mirror(full->recipe());
    ASSERT_TRUE(mirror.execute(plan, look_at({0, 0, 3}, 0)));
    // Colour draws alone have marks, beginning at an odd place: those above the middle 3, those below 0.
    const auto marks = std::make_shared<TriangleMarks>();
    marks->of_triangles.assign(3, 1);
    for (const Command& command : plan.commands)
        marks->first.push_back(command.stage == Stage::colour ? 3 : TriangleMarks::no_marks);
    for (const auto& corners : mirror.triangles_of(0))
        marks->of_triangles.push_back(corners[0].y + corners[1].y + corners[2].y > 0 ? 3 : 0);
    ASSERT_EQ(marks->of_triangles.size() - 3, plan.stats.triangles);
    ShadingOptions look;
    look.debug = DebugView::misses;
    look.marks = marks;
    ASSERT_TRUE(renderer.submit(plan, look_at({0, 0, 3}, 0), look));
    const auto picture = renderer.read_picture();
    ASSERT_TRUE(picture);
    size_t red_above = 0, red_below = 0, blue_above = 0, blue_below = 0;
    for (uint32_t y = 0; y < height; ++y) {
        for (uint32_t x = 0; x < width; ++x) {
            const uint8_t* p = &picture->colour[(size_t{y} * width + x) * 4];
            if (p[3] == 0) continue;
            (y < height / 2 ? (p[0] > p[2] ? red_above : blue_above) : (p[0] > p[2] ? red_below : blue_below)) += 1;
        }
    }
    // Triangles that cross the middle belong to either.
    EXPECT_GT(red_above, 20 * blue_above);
    EXPECT_GT(blue_below, 20 * red_below);
    EXPECT_GT(blue_below, 500u);
}

// Vertices on their way are where the CPU says they are: the same depths as a mesh of the triangles it tells.
TEST_F(RendererTest, MorphsAsTheMirrorDoes) {
    Renderer& renderer = make();
    auto source = open_lod({baked(rock(3000))}, {.order = "static", .geomorph = true});
    ASSERT_TRUE(source);
    FrameInput input = look_at({0, 0.6f, 3}, 0);
    input.budget.pixel_error = 1.5;
    const Plan plan = (*source)->plan(input);
    PlanMirror mirror((*source)->recipe(), {morphed_vertex, {}});
    const auto done = mirror.execute(plan, input);
    ASSERT_TRUE(done) << done.error().message;
    ASSERT_TRUE(renderer.load((*source)->recipe(), plain_materials()));
    ASSERT_TRUE(renderer.submit(plan, input, ShadingOptions{}));
    const auto morphed = renderer.read_picture();
    ASSERT_TRUE(morphed);
    const auto as_mesh = [](const std::vector<std::array<glm::vec3, 3>>& triangles) {
        TriMesh mesh;
        for (const auto& corners : triangles) {
            const auto first = static_cast<uint32_t>(mesh.positions.size());
            mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
            mesh.triangles.push_back({first, first + 1, first + 2});
        }
        mesh.wedge_vertex.resize(mesh.positions.size());
        std::iota(mesh.wedge_vertex.begin(), mesh.wedge_vertex.end(), 0u);
        return mesh;
    };
    // Pixels whose depths are not the same.
    const auto differing = [&](const std::vector<std::array<glm::vec3, 3>>& triangles) {
        auto full = full_of(as_mesh(triangles));
        EXPECT_TRUE(renderer.load(full->recipe(), plain_materials()));
        const Picture plain = drawn(renderer, *full, look_at({0, 0.6f, 3}, 0));
        size_t differ = 0;
        for (size_t i = 0; i < plain.depth.size(); ++i)
            differ += std::abs(plain.depth[i] - morphed->depth[i]) > 1e-4f * plain.depth[i];
        return differ;
    };
    EXPECT_LE(differing(mirror.triangles_of(0)), 3u);
    // And the level without morphs is not the same.
    PlanMirror unmoved((*source)->recipe(),
                       {[](const PlanMirror& m, const Draw& draw, const FrameInput& i, uint32_t n, uint32_t index) {
                            Draw still = draw;
                            still.words[LODE_LOD_WORD_STAYING] = still.words[LODE_LOD_WORD_ARRIVED];
                            return morphed_vertex(m, still, i, n, index);
                        },
                        {}});
    ASSERT_TRUE(unmoved.execute(plan, input));
    EXPECT_GT(differing(unmoved.triangles_of(0)), 200u);
}

TEST_F(RendererTest, ADepthBufferHoldsReversedDepth) {
    Renderer& renderer = make();
    auto full = full_of(rock(1000));
    ASSERT_TRUE(renderer.load(full->recipe(), plain_materials()));
    const FrameInput input = look_at({0, 0, 4}, 0);
    const Picture picture = drawn(renderer, *full, input);
    ASSERT_GT(covered(picture), 1000u);
    for (size_t i = 0; i < picture.depth.size(); ++i) {
        if (picture.colour[4 * i + 3] == 0) {
            EXPECT_EQ(picture.depth[i], 0);
            continue;
        }
        const glm::vec4 p = glm::inverse(input.views[0].view_to_clip) * glm::vec4(0, 0, picture.depth[i], 1);
        EXPECT_NEAR(-p.z / p.w, 4, 1.8);
    }
}

TEST_F(RendererTest, CountsVertexRunsAndPrimitives) {
    Renderer& renderer = make();
    const TriMesh mesh = rock(2000);
    auto full = full_of(mesh);
    ASSERT_TRUE(renderer.load(full->recipe(), plain_materials()));
    drawn(renderer, *full, look_at({0, 0, 4}, 7));
    const auto counters = renderer.take_counters();
    ASSERT_EQ(counters.size(), 1u);
    EXPECT_EQ(counters[0].frame, 7u);
    for (const Stage stage : {Stage::shadow, Stage::depth, Stage::colour}) {
        const auto& pass = counters[0].pass[static_cast<size_t>(stage)];
        EXPECT_EQ(pass.input_primitives, mesh.triangle_count());
        EXPECT_GE(pass.vertex_invocations, mesh.vertex_count());
        EXPECT_LE(pass.vertex_invocations, 3 * mesh.triangle_count());
    }
    EXPECT_EQ(counters[0].pass[static_cast<size_t>(Stage::effect)].input_primitives, 0u);
}

TEST_F(RendererTest, ASlowZoomWithFramesInFlightDrawsWhatSingleFramesDraw) {
    const TriMesh mesh = rock(4000);
    constexpr uint64_t frames = 40;
    const auto input_of = [](uint64_t frame) {
        FrameInput input = look_at({0, 0, 12 - 0.25f * static_cast<float>(frame)}, frame);
        input.budget.pixel_error = 1.5;
        return input;
    };
    std::vector<size_t> coverage;
    std::vector<std::vector<uint8_t>> pictures;
    for (const uint32_t in_flight : {1u, 3u}) {
        RendererOptions options;
        options.frames_in_flight = in_flight;
        Renderer& renderer = make(options);
        auto source = lod_of(mesh);
        ASSERT_TRUE(renderer.load(source->recipe(), plain_materials()));
        uint64_t uploaded = 0;
        for (uint64_t f = 0; f < frames; ++f) {
            FrameInput input = input_of(f);
            input.completed_frame = *renderer.completed_frame();
            const Plan plan = source->plan(input);
            if (f > 0) uploaded += plan.stats.uploaded_bytes;
            ASSERT_TRUE(renderer.submit(plan, input, {}));
            // Only looked at now and then, so that frames do overlap.
            if (f % 13 == 12) pictures.push_back(renderer.read_picture()->colour);
        }
        EXPECT_GT(uploaded, 0u);
        ASSERT_TRUE(renderer.wait());
        EXPECT_EQ(*renderer.completed_frame(), frames);
        EXPECT_EQ(renderer.take_counters().size(), frames);
        EXPECT_THAT(renderer.validation_messages(), testing::IsEmpty());
    }
    ASSERT_EQ(pictures.size(), 6u);
    for (size_t i = 0; i < 3; ++i) EXPECT_EQ(pictures[i], pictures[i + 3]);
}

TEST_F(RendererTest, ThreeHundredInstancesInMotion) {
    Renderer& renderer = make();
    auto source = lod_of(rock(1500), 300);
    ASSERT_TRUE(renderer.load(source->recipe(), plain_materials()));
    for (uint64_t f = 0; f < 8; ++f) {
        std::vector<Instance> instances(300);
        for (size_t i = 0; i < instances.size(); ++i) {
            const auto t = static_cast<float>(i) + 0.2f * static_cast<float>(f);
            instances[i].object_to_world = glm::mat4(0.2f);
            instances[i].object_to_world[3] =
                glm::vec4(4 * std::sin(t), 2 * std::cos(1.7f * t), -6 + 4 * std::cos(t), 1);
        }
        FrameInput input = look_at({0, 0, 3}, f, std::move(instances));
        input.completed_frame = *renderer.completed_frame();
        ASSERT_TRUE(renderer.submit(source->plan(input), input, {}));
    }
    EXPECT_GT(covered(*renderer.read_picture()), 500u);
}

TEST_F(RendererTest, UploadsLargerThanTheStagingMemoryArriveWhole) {
    Renderer& renderer = make();
    Recipe recipe;
    constexpr uint64_t bytes = uint64_t{40} << 20;
    recipe.buffers = {{"large", bytes, use_storage, 4}};
    ASSERT_TRUE(renderer.load(recipe, plain_materials()));
    std::vector<uint32_t> words(bytes / 4);
    for (size_t i = 0; i < words.size(); ++i) words[i] = static_cast<uint32_t>(i * 2654435761u);
    FrameInput input = look_at({0, 0, 3}, 0, {});
    Plan plan;
    plan.commands = {{Stage::update, Upload{0, 0, Blob::copy_of(words.data(), words.size())}},
                     {Stage::update, Upload{0, 8, Blob::copy_of(words.data(), 2)}},  // over the first, so after it
                     {Stage::update, Readback{0, 0, 64, 1}},
                     {Stage::colour, Readback{0, bytes - 64, 64, 2}}};
    ASSERT_TRUE(renderer.submit(plan, input, {}));
    ASSERT_TRUE(renderer.wait());
    const auto back = renderer.take_readbacks();
    ASSERT_EQ(back.size(), 2u);
    const auto word = [&](size_t r, size_t i) { return reinterpret_cast<const uint32_t*>(back[r].blob.data())[i]; };
    EXPECT_EQ(back[0].tag, 1u);
    EXPECT_EQ(word(0, 1), words[1]);
    EXPECT_EQ(word(0, 2), words[0]);
    EXPECT_EQ(word(0, 4), words[4]);
    EXPECT_EQ(word(1, 15), words.back());
}

TEST_F(RendererTest, AComputedIndirectDrawReadsASplitPool) {
    RendererOptions options;
    options.segment_bytes_limit = 4096;
    Renderer& renderer = make(options);
    constexpr uint32_t numbers = 5000;  // five segments
    Recipe recipe;
    recipe.buffers = {{"numbers", numbers * 4, use_storage, 4},
                      {"sums", 8, use_storage, 4},
                      {"arguments", 16, use_storage | use_indirect, 4}};
    PipelineSpec count;
    count.name = "count";
    count.kind = PipelineKind::compute;
    count.compute = "test/count.comp";
    count.storage = {StorageBinding::pool(0, 0, 1), {1, 1, Access::read_write}, {2, 2, Access::write}};
    PipelineSpec pull;
    pull.name = "pull";
    pull.vertex = "test/pull.vert";
    pull.fragment = "test/plain.frag";
    recipe.pipelines = {count, pull};
    ASSERT_TRUE(renderer.load(recipe, plain_materials()));
    std::vector<uint32_t> values(numbers);
    uint32_t sum = 0;
    for (uint32_t i = 0; i < numbers; ++i) sum += values[i] = i * i % 1000;
    const uint32_t zeros[2] = {};
    for (uint64_t frame = 0; frame < 3; ++frame) {
        const auto triangles = static_cast<uint32_t>(frame + 1);
        FrameInput input = look_at({0, 0, 3}, frame, {});
        Plan plan;
        Draw draw;
        draw.pipeline = 1;
        plan.commands = {{Stage::update, Upload{0, 0, Blob::copy_of(values.data(), values.size())}},
                         {Stage::update, Upload{1, 0, Blob::copy_of(zeros, 2)}},
                         {Stage::update, Dispatch{0, {(numbers + 63) / 64, 1, 1}, 0, {numbers, 3 * triangles}}},
                         {Stage::depth, DrawIndirect{draw, 2, 0, 1, 16, no_buffer, 0}},
                         {Stage::colour, DrawIndirect{draw, 2, 0, 1, 16, no_buffer, 0}},
                         {Stage::composite, Readback{1, 0, 8, 9}}};
        ASSERT_TRUE(renderer.submit(plan, input, {}));
        const auto picture = renderer.read_picture();
        ASSERT_TRUE(picture);
        EXPECT_NEAR(static_cast<double>(covered(*picture)), 0.25 * 0.5 * 0.3 * 0.3 * width * height * triangles, 60);
        const auto back = renderer.take_readbacks();
        ASSERT_EQ(back.size(), 1u);
        EXPECT_EQ(back[0].frame, frame);
        EXPECT_EQ(reinterpret_cast<const uint32_t*>(back[0].blob.data())[0], sum);
        EXPECT_EQ(reinterpret_cast<const uint32_t*>(back[0].blob.data())[1], values.back());
    }
}

// What is staged is submitted whenever staging memory is full: commands begin anew, and nothing is bound in them.
TEST_F(RendererTest, DispatchesGoOnAfterMoreThanStagingMemoryHolds) {
    Renderer& renderer = make();
    constexpr uint32_t numbers = 100, more = 40 << 20;
    Recipe recipe;
    recipe.buffers = {{"numbers", numbers * 4, use_storage, 4},
                      {"sums", 8, use_storage, 4},
                      {"arguments", 16, use_storage | use_indirect, 4},
                      {"more", more, use_storage, 4}};
    PipelineSpec count;
    count.name = "count";
    count.kind = PipelineKind::compute;
    count.compute = "test/count.comp";
    count.storage = {StorageBinding::pool(0, 0, 1), {1, 1, Access::read_write}, {2, 2, Access::write}};
    recipe.pipelines = {count};
    ASSERT_TRUE(renderer.load(recipe, plain_materials()));
    const std::vector<uint32_t> threes(numbers, 3), filler(more / 4);
    const uint32_t zeros[2] = {};
    const Dispatch dispatch{0, {(numbers + 63) / 64, 1, 1}, 0, {numbers, 0}};
    Plan plan;
    plan.commands = {{Stage::update, Upload{0, 0, Blob::copy_of(threes.data(), threes.size())}},
                     {Stage::update, Upload{1, 0, Blob::copy_of(zeros, 2)}},
                     {Stage::update, dispatch},
                     {Stage::update, Upload{3, 0, Blob::copy_of(filler.data(), filler.size())}},
                     {Stage::update, dispatch},
                     {Stage::composite, Readback{1, 0, 8, 9}}};
    ASSERT_TRUE(renderer.submit(plan, look_at({0, 0, 3}, 0, {}), {}));
    ASSERT_TRUE(renderer.wait());
    const auto back = renderer.take_readbacks();
    ASSERT_EQ(back.size(), 1u);
    EXPECT_EQ(reinterpret_cast<const uint32_t*>(back[0].blob.data())[0], 2 * 3 * numbers);
}

// Each dispatch writes how many groups the next one has, into the buffer that its own came from.
TEST_F(RendererTest, ADispatchHasAsManyGroupsAsTheOneBeforeSays) {
    Renderer& renderer = make();
    Recipe recipe;
    recipe.buffers = {{"arguments", 60, use_storage | use_indirect, 4},
                      {"counts", 16, use_storage, 4},
                      {"arguments of nobody", 60, use_storage, 4}};
    PipelineSpec halve;
    halve.name = "halve";
    halve.kind = PipelineKind::compute;
    halve.compute = "test/halve.comp";
    halve.storage = {{0, 0, Access::write}, {1, 1, Access::read_write}};
    PipelineSpec last = halve;  // does not write what it reads
    last.storage[0].buffer = 2;
    recipe.pipelines = {halve, last};
    ASSERT_TRUE(renderer.load(recipe, plain_materials()));
    PlanMirror mirror(recipe);
    const uint32_t zeros[15] = {};
    for (uint64_t frame = 0; frame < 3; ++frame) {
        const auto groups = static_cast<uint32_t>(7 + 2 * frame);
        const FrameInput input = look_at({0, 0, 3}, frame, {});
        Plan plan;
        plan.commands = {{Stage::update, Upload{0, 0, Blob::copy_of(zeros, 15)}},
                         {Stage::update, Upload{1, 0, Blob::copy_of(zeros, 4)}},
                         {Stage::update, Dispatch{0, {groups, 1, 1}, 0, {0}}}};
        for (uint32_t k = 1; k < 4; ++k)
            plan.commands.push_back({Stage::update, Dispatch{k / 3, {99, 99, 99}, 0, {k}, 0, 12 * uint64_t{k}}});
        plan.commands.push_back({Stage::composite, Readback{1, 0, 16, 9}});
        const auto mirrored = mirror.execute(plan, input);
        ASSERT_TRUE(mirrored) << mirrored.error().message;
        ASSERT_TRUE(renderer.submit(plan, input, {}));
    }
    ASSERT_TRUE(renderer.wait());
    const auto back = renderer.take_readbacks();
    ASSERT_EQ(back.size(), 3u);
    for (const ReadbackResult& r : back) {
        const auto groups = static_cast<uint32_t>(7 + 2 * r.frame);
        ASSERT_EQ(r.blob.size(), 16u);
        const std::span counts(reinterpret_cast<const uint32_t*>(r.blob.data()), 4);
        EXPECT_THAT(counts, testing::ElementsAre(groups, groups / 2, groups / 4, groups / 8)) << r.frame;
    }
}

// Two triangles by pipelines of unlike stencils: each is lit where a pipeline of its own covers the view, and there
// alone.
TEST_F(RendererTest, LightsWhatIsVisibleByItsStencil) {
    Renderer& renderer = make();
    Recipe recipe;
    for (const uint32_t stencil : {0u, 5u}) {
        PipelineSpec& visible = recipe.pipelines.emplace_back();
        visible.name = "visible";
        visible.vertex = "test/pull.vert";
        visible.visibility = "test/visible.frag";
        visible.stencil = stencil;
    }
    for (const uint32_t stencil : {0u, 5u, 4u}) {
        PipelineSpec& lighting = recipe.pipelines.emplace_back();
        lighting.name = "lighting";
        lighting.vertex = "frame/whole_view.vert";
        lighting.fragment = "test/light.frag";
        lighting.whole_view = true;
        lighting.stencil = stencil;
    }
    ASSERT_TRUE(renderer.load(recipe, plain_materials()));
    const FrameInput input = look_at({0, 0, 3}, 0);
    for (uint32_t lit = 0; lit < 8; ++lit) {
        Plan plan;
        plan.instance_ids = {0};
        for (uint32_t p = 0; p < 5; ++p) {
            if (p >= 2 && (lit >> (p - 2) & 1) == 0) continue;
            Draw draw;
            draw.pipeline = p;
            draw.first_vertex = p == 1 ? 3 : 0;
            draw.count = 3;
            plan.commands.push_back({p < 2 ? Stage::depth : Stage::colour, draw});
        }
        ASSERT_TRUE(PlanMirror(recipe).execute(plan, input));
        ASSERT_TRUE(renderer.submit(plan, input, {}));
        const auto picture = renderer.read_picture();
        ASSERT_TRUE(picture);
        for (int triangle = 0; triangle < 2; ++triangle) {
            const auto column = static_cast<size_t>((0.15 + 0.4 * triangle) / 2 * width),
                       row = static_cast<size_t>((1 + 0.45) / 2 * height);
            EXPECT_EQ(picture->colour[(row * width + column) * 4 + 3], (lit >> triangle & 1) != 0 ? 255 : 0)
                << triangle << " of " << lit;
        }
    }
}

TEST_F(RendererTest, LightsWhatIsVisibleBesideWhatIsLitAsItIsDrawn) {
    Renderer& renderer = make();
    PipelineSpec visible, lit, lighting;
    visible.name = "visible";
    visible.vertex = lit.vertex = "test/pull.vert";
    visible.visibility = "test/visible.frag";
    lit.name = "lit";
    lit.fragment = "test/plain.frag";
    lighting.name = "lighting";
    lighting.vertex = "frame/whole_view.vert";
    lighting.fragment = "test/light.frag";
    lighting.whole_view = true;
    Recipe recipe;
    recipe.pipelines = {visible, lit, lighting};
    ASSERT_TRUE(renderer.load(recipe, plain_materials()));
    const FrameInput input = look_at({0, 0, 3}, 0);
    Plan plan;
    plan.instance_ids = {0};
    Draw two, third, light;
    two.count = 6;
    third.pipeline = 1;
    third.first_vertex = 6;
    light.pipeline = 2;
    third.count = light.count = 3;
    plan.commands = {{Stage::depth, two}, {Stage::depth, third}, {Stage::colour, light}, {Stage::colour, third}};
    ASSERT_TRUE(PlanMirror(recipe).execute(plan, input));
    for (int frame = 0; frame < 2; ++frame) {
        ASSERT_TRUE(renderer.submit(plan, input, {}));
        const auto picture = renderer.read_picture();
        ASSERT_TRUE(picture);
        const auto pixel = [&](double x, double y) {
            const auto column = static_cast<size_t>((x + 1) / 2 * width),
                       row = static_cast<size_t>((1 - y) / 2 * height);
            const uint8_t* p = &picture->colour[(row * width + column) * 4];
            return std::array<int, 4>{p[0], p[1], p[2], p[3]};
        };
        const auto srgb = [](double linear) { return 255 * (1.055 * std::pow(linear, 1 / 2.4) - 0.055); };
        for (int triangle = 0; triangle < 3; ++triangle) {
            const auto p = pixel(-0.85 + 0.4 * triangle, -0.45);
            EXPECT_NEAR(p[0], triangle < 2 ? srgb((triangle + 1) * 64 / 255.0) : 255, 2) << triangle;
            EXPECT_NEAR(p[1], triangle < 2 ? 255 : srgb(0.5), 2) << triangle;
            EXPECT_EQ(p[3], 255);
            EXPECT_EQ(pixel(-0.65 + 0.4 * triangle, -0.25)[3], 0) << "nothing was drawn there";
        }
        EXPECT_NEAR(static_cast<double>(covered(*picture)), 0.25 * 0.5 * 0.3 * 0.3 * width * height * 3, 60);
        // Another size, and the same again.
        ASSERT_TRUE(renderer.resize(width, height));
    }
    // A recipe that asks for none of it.
    recipe.pipelines = {lit};
    ASSERT_TRUE(renderer.load(recipe, plain_materials()));
    third.pipeline = 0;
    plan.commands = {{Stage::depth, third}, {Stage::colour, third}};
    ASSERT_TRUE(renderer.submit(plan, input, {}));
    EXPECT_TRUE(renderer.read_picture());
}

TEST_F(RendererTest, CopiesBetweenBuffersAcrossSegments) {
    RendererOptions options;
    options.segment_bytes_limit = 256;
    Renderer& renderer = make(options);
    Recipe recipe;
    recipe.buffers = {{"from", 1024, use_storage, 4}, {"to", 1024, use_storage, 4}};
    ASSERT_TRUE(renderer.load(recipe, plain_materials()));
    std::vector<uint32_t> words(256);
    for (uint32_t i = 0; i < 256; ++i) words[i] = i;
    FrameInput input = look_at({0, 0, 3}, 0, {});
    Plan plan;
    plan.commands = {{Stage::update, Upload{0, 0, Blob::copy_of(words.data(), 256)}},
                     {Stage::update, Copy{0, 1, 100, 300, 600}},
                     {Stage::update, Readback{1, 300, 600, 0}}};
    ASSERT_TRUE(renderer.submit(plan, input, {}));
    ASSERT_TRUE(renderer.wait());
    const auto back = renderer.take_readbacks();
    ASSERT_EQ(back.size(), 1u);
    for (uint32_t i = 0; i < 150; ++i) EXPECT_EQ(reinterpret_cast<const uint32_t*>(back[0].blob.data())[i], 25 + i);
}

TEST_F(RendererTest, BuffersGrowAndShrinkWhileFramesThatReadThemAreInFlight) {
    for (const uint32_t segment : {0u, 256u}) {
        RendererOptions options;
        options.segment_bytes_limit = segment;
        options.frames_in_flight = 3;
        Renderer& renderer = make(options);
        Recipe recipe;
        recipe.buffers = {{"words", 64, use_storage, 4, 1024}, {"kept", 1024, use_storage, 4}};
        ASSERT_TRUE(renderer.load(recipe, plain_materials()));
        std::vector<uint32_t> words(256);
        std::iota(words.begin(), words.end(), 1u);
        const uint64_t before = renderer.buffer_bytes();
        // Each frame has its size, keeps what it can, and writes the rest; then it is read back.
        const std::vector<uint64_t> sizes{64, 1024, 300, 64, 600};
        uint64_t written = 0;
        for (uint64_t f = 0; f < sizes.size(); ++f) {
            const uint64_t kept = std::min(written, sizes[f]);
            Plan plan;
            if (f > 0) plan.commands.push_back({Stage::update, Resize{0, sizes[f], kept}});
            if (sizes[f] > kept) {
                plan.commands.push_back(
                    {Stage::update, Upload{0, kept, Blob::copy_of(&words[kept / 4], (sizes[f] - kept) / 4)}});
            }
            plan.commands.push_back({Stage::composite, Readback{0, 0, sizes[f], static_cast<uint32_t>(f)}});
            ASSERT_TRUE(renderer.submit(plan, look_at({0, 0, 3}, f, {}), {}));
            written = sizes[f];
        }
        ASSERT_TRUE(renderer.wait());
        const auto back = renderer.take_readbacks();
        ASSERT_EQ(back.size(), sizes.size());
        for (size_t f = 0; f < sizes.size(); ++f) {
            ASSERT_EQ(back[f].blob.size(), sizes[f]);
            EXPECT_EQ(std::memcmp(back[f].blob.data(), words.data(), sizes[f]), 0) << f;
        }
        EXPECT_GE(renderer.buffer_bytes(), 600u + 1024u);
        EXPECT_LT(renderer.buffer_bytes(), before + 1024) << "what was replaced is freed once it is not read";
        EXPECT_THAT(renderer.validation_messages(), testing::IsEmpty());
    }
}

TEST_F(RendererTest, ResizesAndReloads) {
    Renderer& renderer = make();
    auto full = full_of(rock(500));
    ASSERT_TRUE(renderer.load(full->recipe(), plain_materials()));
    drawn(renderer, *full, look_at({0, 0, 4}, 0));
    ASSERT_TRUE(renderer.resize(64, 48));
    EXPECT_FALSE(renderer.read_picture());  // nothing was drawn at this size
    FrameInput input = look_at({0, 0, 4}, 1);
    input.views[0] = view_of(Camera{{0, 0, 4}}, 64, 48);
    const Picture picture = drawn(renderer, *full, input);
    EXPECT_EQ(picture.width, 64u);
    EXPECT_GT(covered(picture), 200u);
    ASSERT_FALSE(renderer.resize(0, 10));
    auto again = full_of(fixtures::octahedron());
    ASSERT_TRUE(renderer.load(again->recipe(), plain_materials()));
}

TEST_F(RendererTest, NamesWhatItLacks) {
    RendererOptions options;
    options.device = "no such device";
    const auto none = Renderer::create(options);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().fault, Fault::machine);
    EXPECT_THAT(none.error().message, testing::HasSubstr("no device 'no such device'; there are 0: "));
    Renderer& renderer = make();
    Recipe recipe;
    recipe.buffers = {{"b", 16, use_storage, 4}};
    PipelineSpec spec;
    spec.name = "missing";
    spec.kind = PipelineKind::compute;
    spec.compute = "test/missing.comp";
    recipe.pipelines = {spec};
    const auto loaded = renderer.load(recipe, plain_materials());
    ASSERT_FALSE(loaded);
    EXPECT_THAT(loaded.error().message, testing::HasSubstr("test/missing.comp"));
}

TEST_F(RendererTest, MirroredInstancesAreWhole) {
    Renderer& renderer = make();
    auto full = full_of(fixtures::octahedron());
    ASSERT_TRUE(renderer.load(full->recipe(), plain_materials()));
    const size_t plain = covered(drawn(renderer, *full, look_at({0, 0, 4}, 0)));
    Instance mirrored;
    mirrored.object_to_world[0][0] = -1;
    EXPECT_EQ(covered(drawn(renderer, *full, look_at({0, 0, 4}, 1, {mirrored}))), plain);
}

}  // namespace
}  // namespace lodestone
