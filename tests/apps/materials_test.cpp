// Materials of a glTF file as each backend draws them, against the picture of `full`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/gtc/matrix_transform.hpp>

#include "apps/drawing/session.h"
#include "apps/drawn_scene.h"
#include "base/looks/srgb.h"
#include "fixtures/materials.h"
#include "mesh/generate.h"
#include "mesh/io/image_file.h"
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

    void make_still_life() {
        DrawnSceneTest::make_still_life(wide, tall);
        camera_.eye = {1.2f, 1.3f, 3.4f};
        camera_.target = {0, -0.1f, 0};
    }
    // Lit, the channels, and lit with smoke.
    std::vector<Picture> drawn(const Technique& way, const Budget& budget) {
        auto session = DrawSession::open(scene_, *renderer_, way, false, {});
        EXPECT_TRUE(session);
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
    // A decibel or two below what was measured. Those of lod are moved texture coordinates; those of vgi single samples
    // where texture coordinates jump, and rims of holes.
    is_near(full, {"lod", "keyframe", ""}, 0.5, {47, 47, 56, 52, 54, 50, 47, 56, 47});
    is_near(full, {"lod", "keyframe", "geomorph"}, 0.5, {76, 77, 77, 89, 82, 89, 98, 98, 77});
    is_near(full, {"vgi", "", ""}, 0.25, {38.5, 42, 39.5, 40.5, 35, 36.5, 35.5, 44, 41});
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
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
    const Ended e = run("view s.scene.json --backend vgi --validation --size 160x120 --keys H,X,wait:3,F12",
                        "xvfb-run -a -s '-screen 0 800x600x24' ");
    ASSERT_EQ(e.code, 0) << e.err;
    const auto shot = read_image(folder_ / "lodestone-1.png");
    ASSERT_TRUE(shot) << shot.error().message;
    const double share = share_drawn(*shot);
    EXPECT_GT(share, 0.04);
    EXPECT_LT(share, 0.4);
}

}  // namespace
}  // namespace lodestone
