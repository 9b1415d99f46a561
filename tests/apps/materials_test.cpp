// Materials of a glTF file as each backend draws them, against the picture of `full`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "apps/drawing/session.h"
#include "apps/drawn_scene.h"
#include "base/looks/srgb.h"
#include "fixtures/materials.h"
#include "fixtures/real_data.h"
#include "mesh/generate.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"
#include "report/image_metrics.h"

namespace lodestone {
namespace {

// How near a backend comes to `full`, decibels of luminance where either covers.
struct Nearness {
    double lit, normal, base_colour, alpha, metallic, roughness, occlusion, emission, smoky;
};

class MaterialsProgramTest : public DrawnSceneTest {
protected:
    // Odd, so that nothing rests on halves.
    static constexpr uint32_t wide = 333, tall = 251;

    void make_still_life(const TriMesh& mesh = fixtures::still_life()) {
        DrawnSceneTest::make_still_life(wide, tall, mesh);
        camera_.eye = {1.2f, 1.3f, 3.4f};
        camera_.target = {0, -0.1f, 0};
    }
    void make_still_life(const std::string& file) {
        write_still_life(file);
        make_ready("s.scene.json", wide, tall);
    }
    // What a command that ends well says beside its output.
    std::string said(const std::string& command) const {
        const Ended ended = run(command);
        EXPECT_EQ(ended.code, 0) << ended.err;
        return ended.err;
    }
    // Lit, the channels, and lit with smoke.
    std::vector<Picture> drawn(const Technique& way, const Budget& budget) {
        auto session = DrawSession::open(scene_, *renderer_, way, false, {});
        EXPECT_TRUE(session) << session.error().message;
        (*session)->time = 3;
        std::vector<Picture> all;
        const auto draw = [&](DebugView view, bool smoke) {
            (*session)->look.debug = view;
            (*session)->shows_volumes = smoke;
            EXPECT_TRUE((*session)->settle(camera_, budget, wide, tall));
            auto picture = renderer_->read_picture();
            EXPECT_TRUE(picture);
            all.push_back(std::move(*picture));
        };
        for (const DebugView view :
             {DebugView::none, DebugView::normal, DebugView::base_colour, DebugView::alpha, DebugView::metallic,
              DebugView::roughness, DebugView::occlusion, DebugView::emission})
            draw(view, false);
        draw(DebugView::none, true);
        return all;
    }
    void is_near(const std::vector<Picture>& full, const Technique& way, double pixel_error, const Nearness& least) {
        SCOPED_TRACE(name_of(way));
        const auto other = drawn(way, {.pixel_error = pixel_error});
        const double bounds[] = {least.lit,       least.normal,    least.base_colour, least.alpha, least.metallic,
                                 least.roughness, least.occlusion, least.emission,    least.smoky};
        for (size_t i = 0; i < full.size(); ++i) {
            const double psnr = psnr_db(other[i], full[i], covered_union(other[i], full[i]));
            std::printf("%s, picture %zu: %.1f dB to full\n", name_of(way).c_str(), i, psnr);
            EXPECT_GT(psnr, bounds[i]) << i;
        }
    }
    Camera camera_;
};

TEST_F(MaterialsProgramTest, WhichBackendDrawsThemHardlyShows) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    make_still_life();
    ASSERT_NE(renderer_, nullptr);
    const auto full = drawn({"full", "", ""}, {});
    // The glass shows its own alpha, not what it lets through.
    const auto grey = static_cast<uint8_t>(std::lround(255 * srgb_from_linear(0.45)));
    size_t glassy = 0;
    for (size_t i = 0; i < full[3].colour.size(); i += 4) glassy += std::abs(full[3].colour[i] - grey) <= 1;
    EXPECT_GT(glassy, 2000);
    // The same triangles.
    is_near(full, {"discrete", "", ""}, 0.5, {99, 99, 99, 99, 99, 99, 99, 99, 99});
    // A decibel or two below what was measured. Those of lod are moved texture coordinates; those of vgi samples
    // where materials meet, and rims of holes.
    is_near(full, {"lod", "keyframe", ""}, 0.5, {47, 47, 56, 52, 54, 50, 47, 56, 47});
    is_near(full, {"lod", "keyframe", "geomorph"}, 0.5, {76, 77, 77, 89, 82, 89, 98, 98, 77});
    is_near(full, {"vgi", "", ""}, 0.25, {38.5, 42, 40, 40.5, 38.5, 38, 36, 44.5, 41});
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

// Maps of normals, occlusion and emission on a second set of texture coordinates.
TEST_F(MaterialsProgramTest, WhichBackendDrawsTwoSetsHardlyShows) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    make_still_life(fixtures::still_life_of_two_sets());
    ASSERT_NE(renderer_, nullptr);
    const auto full = drawn({"full", "", ""}, {});
    is_near(full, {"discrete", "", ""}, 0.5, {99, 99, 99, 99, 99, 99, 99, 99, 99});
    is_near(full, {"lod", "keyframe", ""}, 0.5, {47, 47, 56, 52, 54, 50, 47, 56, 47});
    is_near(full, {"lod", "keyframe", "geomorph"}, 0.5, {76, 77, 77, 89, 82, 89, 89, 98, 77});
    // Its textures are baked into the atlas, whose samples are coarser than texels.
    is_near(full, {"vgi", "", ""}, 0.25, {37, 35, 35, 34, 32.5, 31.5, 29.5, 38, 38.5});
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

// The second set, where the mesh has it, and what is said of it. Returns how many textures are on it.
size_t second_set_of(const fs::path& path) {
    ReadReport told;
    const auto mesh = read_mesh(path, {}, &told);
    EXPECT_TRUE(mesh) << mesh.error().message;
    if (!mesh) return 0;
    EXPECT_THAT(told.warnings, testing::IsEmpty());
    size_t textures = 0;
    for (const Material& m : mesh->material_table)
        textures += std::ranges::count_if(m.textures(), [](const Texture* t) { return t->there() && t->second; });
    EXPECT_EQ(mesh->second_uvs.empty(), textures == 0);
    // As fixtures::still_life_of_two_sets() has it.
    for (const Triangle& t : mesh->triangles) {
        if (textures == 0 || !use_second_set({&mesh->material_table[mesh->materials[t[0]]], 1})) continue;
        const glm::vec3& p = mesh->positions[mesh->wedge_vertex[t[0]]];
        EXPECT_NEAR(mesh->second_uvs[t[0]].x, 0.5f * p.x + 0.3f * p.z, 2e-5f);
        EXPECT_NEAR(mesh->second_uvs[t[0]].y, 0.2f * p.z - 0.5f * p.y, 2e-5f);
    }
    return textures;
}

TEST_F(MaterialsProgramTest, TwoSetsComeThroughAssetsAndFiles) {
    ASSERT_TRUE(write_mesh(fixtures::still_life_of_two_sets(), folder_ / "two.glb"));
    succeeds("bake two.glb -o two.lode --backends lod,discrete,full");
    succeeds("verify two.lode");
    for (const char* level : {"0", "30"}) {
        succeeds(std::string("extract two.lode -o out.glb --level ") + level);
        EXPECT_EQ(second_set_of(folder_ / "out.glb"), 3u) << level;
    }
    const Ended obj = run("extract two.lode -o out.obj --level 0");
    EXPECT_EQ(obj.code, 0) << obj.err;
    for (const char* kind : {"normals", "occlusion", "emission"})
        EXPECT_NE(obj.err.find(std::string("OBJ does not hold the textures of ") + kind), std::string::npos) << obj.err;
    // What is laid out anew has one set.
    for (const char* made :
         {"unwrap two.glb -o one.glb --bake", "bake two.glb -o one.lode --backends lod --retexture"}) {
        const Ended ended = run(made);
        EXPECT_EQ(ended.code, 0) << ended.err;
    }
    EXPECT_EQ(second_set_of(folder_ / "one.glb"), 0u);
    succeeds("extract one.lode -o one.glb --level 0");
    EXPECT_EQ(second_set_of(folder_ / "one.glb"), 0u);
}

// The rock's tangents are not what its texture coordinates tell.
TEST_F(MaterialsProgramTest, WhichBackendDrawsTangentsHardlyShows) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    make_still_life();
    const auto without = drawn({"full", "", ""}, {});
    make_still_life(fixtures::still_life_of_tangents());
    ASSERT_NE(renderer_, nullptr);
    const auto full = drawn({"full", "", ""}, {});
    EXPECT_LT(psnr_db(without[1], full[1], covered_union(without[1], full[1])), 35) << "of normals";
    is_near(full, {"discrete", "", ""}, 0.5, {99, 99, 99, 99, 99, 99, 99, 99, 99});
    is_near(full, {"lod", "keyframe", ""}, 0.5, {47, 47, 56, 52, 54, 50, 47, 56, 47});
    is_near(full, {"lod", "keyframe", "geomorph"}, 0.5, {76, 77, 77, 89, 82, 89, 98, 98, 77});
    // An atlas has no tangents: they count where its normals are baked.
    is_near(full, {"vgi", "", ""}, 0.25, {27, 30, 40, 40.5, 38.5, 38, 36, 44.5, 31.5});
    succeeds("bake still.glb -o still.lode --backends lod,vgi");
    make_still_life("still.lode");
    is_near(full, {"vgi", "", ""}, 0.25, {38.5, 41, 38, 40.5, 33.5, 36.5, 35.5, 44, 39.5});
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

// How far two squares of 49 x 49 pixels are from each other, the mean of a channel.
double apart(const Picture& picture, const glm::ivec2& a, const glm::ivec2& b) {
    double sum = 0;
    for (int i = 0; i < 49 * 49; ++i) {
        const glm::ivec2 from(i % 49 - 24, i / 49 - 24);
        const auto at = [&](const glm::ivec2& middle, int channel) -> int {
            const glm::ivec2 p = middle + from;
            return picture.colour.at(4 * (static_cast<size_t>(p.y) * picture.width + static_cast<size_t>(p.x)) +
                                     static_cast<size_t>(channel));
        };
        for (int k = 0; k < 3; ++k) sum += std::abs(at(a, k) - at(b, k));
    }
    return sum / (3 * 49 * 49);
}

// Balls of normals in five turns; in frames that are mirrored along one direction of their texture, or the other, they
// are the same.
TEST_F(MaterialsProgramTest, MirroredTangentsOfKhronosShowTheSameBalls) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    const char* file = "materials/NormalTangentMirrorTest/NormalTangentMirrorTest.glb";
    const auto path = fixtures::real_data(file);
    if (!path) GTEST_SKIP() << fixtures::missing_data_note(file);
    fs::copy_file(*path, folder_ / "mirror.glb");
    succeeds("bake mirror.glb -o mirror.lode --backends full,lod,vgi");
    std::ofstream(folder_ / "s.scene.json") << R"({"lodestone": "scene", "version": 1,
        "assets": [{"name": "a", "file": "mirror.lode"}], "light": {"shadows": false}})";
    constexpr uint32_t side = 800;
    make_ready("s.scene.json", side, side);
    ASSERT_NE(renderer_, nullptr);
    camera_.eye = {0, 0, 3.2f};
    camera_.target = {0, 0, 0};
    for (const char* backend : {"full", "lod", "vgi"}) {
        auto session = DrawSession::open(scene_, *renderer_, {backend, "", ""}, false, {});
        ASSERT_TRUE(session) << session.error().message;
        (*session)->look.debug = DebugView::normal;
        EXPECT_TRUE((*session)->settle(camera_, {.pixel_error = 0.25}, side, side));
        const auto picture = renderer_->read_picture();
        ASSERT_TRUE(picture);
        for (const int row : {158, 279, 400, 520, 641}) {
            EXPECT_LT(apart(*picture, {112, row}, {210, row}), 3) << backend << ", across, row " << row;
            EXPECT_LT(apart(*picture, {112, row}, {312, row}), 3) << backend << ", down, row " << row;
        }
        EXPECT_GT(apart(*picture, {112, 158}, {112, 190}), 20) << "it does see where they differ";
    }
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

// How many wedges have tangents, which are those of fixtures::still_life_of_tangents().
size_t tangents_of(const fs::path& path) {
    auto mesh = read_mesh(path);
    EXPECT_TRUE(mesh) << mesh.error().message;
    if (!mesh || mesh->tangents.empty()) return 0;
    drop_unreferenced(*mesh);
    size_t there = 0;
    for (size_t w = 0; w < mesh->wedge_count(); ++w) {
        const glm::vec4 &is = mesh->tangents[w], expected = fixtures::still_life_tangent(mesh->normals[w]);
        EXPECT_EQ(is.w != 0, mesh->material_table[mesh->materials[w]].normal_texture.there());
        if (is.w == 0) continue;
        ++there;
        EXPECT_EQ(is.w, expected.w);
        EXPECT_LT(glm::distance(glm::vec3(is), glm::vec3(expected)), 2e-3f);
    }
    return there;
}

TEST_F(MaterialsProgramTest, TangentsComeThroughAssetsAndFiles) {
    ASSERT_TRUE(write_mesh(fixtures::still_life_of_tangents(), folder_ / "bent.glb"));
    succeeds("bake bent.glb -o bent.lode --backends lod,discrete,full");
    succeeds("verify bent.lode");
    EXPECT_NE(run("info bent.lode --json").out.find("tangents"), std::string::npos);
    size_t before = ~size_t{0};
    for (const char* level : {"0", "30", "2000"}) {
        for (const char* encoding : {"plain", "meshopt"}) {
            succeeds(std::string("extract bent.lode -o out.glb --level ") + level + " --encoding " + encoding);
            const size_t there = tangents_of(folder_ / "out.glb");
            EXPECT_GT(there, 100u) << level;
            EXPECT_LE(there, before) << level;
            before = there;
        }
    }
    for (const char* made :
         {"unwrap bent.glb -o new.glb --bake", "bake bent.glb -o new.lode --backends lod --retexture"}) {
        const Ended ended = run(made);
        EXPECT_EQ(ended.code, 0) << ended.err;
    }
    EXPECT_EQ(tangents_of(folder_ / "new.glb"), 0u) << "what is laid out anew has none";
    succeeds("extract new.lode -o new.glb --level 0");
    EXPECT_EQ(tangents_of(folder_ / "new.glb"), 0u);
}

TEST_F(MaterialsProgramTest, TangentsThatAnAtlasDoesNotKeepAreToldOf) {
    ASSERT_TRUE(write_mesh(fixtures::still_life_of_tangents(), folder_ / "bent.glb"));
    ASSERT_TRUE(write_mesh(fixtures::still_life(), folder_ / "without.glb"));
    const auto note = testing::HasSubstr("bent.glb: an atlas keeps no tangents");
    EXPECT_THAT(said("bake bent.glb -o a.lode --backends vgi --keep-uv"), note);
    EXPECT_THAT(said("bake bent.glb -o b.lode --backends vgi"), testing::Not(note));
    EXPECT_THAT(said("bake without.glb -o c.lode --backends vgi --keep-uv"),
                testing::Not(testing::HasSubstr("tangents")));
}

TEST_F(MaterialsProgramTest, TwoSetsAreBakedIntoAtlasesWhateverIsAsked) {
    ASSERT_TRUE(write_mesh(fixtures::still_life_of_two_sets(), folder_ / "two.glb"));
    const auto note = testing::HasSubstr("textures lie on two sets of texture coordinates, and an atlas keeps one");
    EXPECT_THAT(said("bake two.glb -o a.lode --backends vgi"), testing::Not(note));
    EXPECT_THAT(said("bake two.glb -o b.lode --backends vgi --keep-uv"), note);
    EXPECT_NE(content_of(folder_ / "b.lode").find(R"("baked":true)"), std::string::npos);
    EXPECT_EQ(run("info b.lode").out.find("mesh/image"), std::string::npos);
    succeeds("verify b.lode");
    EXPECT_THAT(said("tile two.glb -o tiles"), testing::HasSubstr("textures are baked into the atlas"));
}

// A sheet that looks up stands there mirrored, and beside it as it is.
TEST_F(MaterialsProgramTest, WhatIsMirroredShowsItsFrontAndNotItsBack) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    std::ofstream(folder_ / "s.scene.json") << R"({"lodestone": "scene", "version": 1,
        "assets": [{"name": "a", "generate": {"shape": "grid", "triangles": 800}}]})";
    make_ready("s.scene.json", wide, tall, [](Scene& scene) {
        const glm::mat4 beside = glm::translate(glm::mat4(1), glm::vec3(2, 0, 0));
        scene.instances.push_back({0, glm::scale(beside, glm::vec3(-1, 1, 1))});
    });
    EXPECT_TRUE(scene_.materials.mirrors);
    for (const char* backend : {"full", "vgi"}) {
        auto session = DrawSession::open(scene_, *renderer_, {backend, "", ""}, false, {});
        ASSERT_TRUE(session);
        const auto covered = [&](float height) {
            camera_.target = {1, 0, 0};
            camera_.eye = {1, height, 0.5f};
            EXPECT_TRUE((*session)->settle(camera_, {}, wide, tall));
            const auto picture = renderer_->read_picture();
            EXPECT_TRUE(picture);
            size_t count = 0;
            for (size_t i = 3; i < picture->colour.size(); i += 4) count += picture->colour[i] > 0;
            return count;
        };
        EXPECT_GT(covered(5), 10000) << backend;
        // Where vgi joins levels, slivers of samples face any way.
        EXPECT_LE(covered(-5), std::string_view(backend) == "vgi" ? 40 : 0) << backend;
    }
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

// Of something closed no back is seen: whether backs are shown makes no difference, at its rims neither, where normals
// between corners point away from the eye.
TEST_F(MaterialsProgramTest, WhatShowsBothSidesLooksAsItsFrontDoes) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    TriMesh rock = generate(Shape::rock, 3000);
    rock.normals = vertex_normals(rock);
    rock.material_table.assign(1, {});
    rock.material_table[0].shading = Shading::metallic_roughness;
    for (const bool both : {false, true}) {
        rock.material_table[0].double_sided = both;
        ASSERT_TRUE(write_mesh(rock, folder_ / (both ? "both.glb" : "one.glb")));
    }
    for (const char* backend : {"full", "lod", "vgi"}) {
        for (const char* view : {"none", "normal"}) {
            const std::string how = std::string(" --size 333x251 --backend ") + backend + " --debug " + view;
            succeeds("render one.glb" + how + " -o one.png");
            succeeds("render both.glb" + how + " -o both.png");
            const auto one = read_image(folder_ / "one.png"), other = read_image(folder_ / "both.png");
            ASSERT_TRUE(one && other);
            size_t apart = 0;
            for (size_t i = 0; i < one->texels.size(); ++i) apart += one->texels[i] != other->texels[i];
            // A normal far to the other side of what is seen counts.
            EXPECT_LE(apart, 3u) << how;
        }
    }
}

// The share of a picture's pixels that differ from its first.
double share_drawn(const Image& image) {
    const auto other = std::ranges::count_if(image.texels, [&](const glm::u8vec4& t) { return t != image.texels[0]; });
    return static_cast<double>(other) / static_cast<double>(image.texels.size());
}

// Lines show all triangles, whatever their materials.
TEST_F(MaterialsProgramTest, LinesShowWhatIsBlended) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    if (std::system("command -v xvfb-run > /dev/null") != 0)
        GTEST_SKIP() << "no display; install xvfb to run this test";
    TriMesh ball = generate(Shape::sphere, 300);
    ball.material_table.resize(1);
    ball.materials.assign(ball.wedge_count(), 0);
    ball.material_table[0].alpha_mode = AlphaMode::blend;
    ball.material_table[0].base_colour.w = 0.5f;
    ASSERT_TRUE(write_mesh(ball, folder_ / "ball.glb"));
    std::ofstream(folder_ / "s.scene.json") << R"({"lodestone": "scene", "version": 1,
        "assets": [{"name": "a", "file": "ball.glb"}], "light": {"shadows": false}})";
    const Ended e =
        run("view s.scene.json --backend vgi --validation --size 160x120 --keys H,X,wait:3,F12", own_display);
    ASSERT_EQ(e.code, 0) << e.err;
    const auto shot = read_image(folder_ / "lodestone-1.png");
    ASSERT_TRUE(shot) << shot.error().message;
    const double share = share_drawn(*shot);
    EXPECT_GT(share, 0.04);
    EXPECT_LT(share, 0.4);
}

}  // namespace
}  // namespace lodestone
