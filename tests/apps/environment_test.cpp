// --environment through the program, and what each backend makes of light from all around.
#include <gtest/gtest.h>

#include <cstdio>
#include <glm/geometric.hpp>

#include "apps/drawn_scene.h"
#include "base/looks/srgb.h"
#include "fixtures/materials.h"
#include "light/prefilter.h"
#include "light/sky.h"
#include "mesh/io/image_file.h"
#include "mesh/io/write.h"
#include "report/image_metrics.h"

namespace lodestone {
namespace {

class EnvironmentProgramTest : public DrawnSceneTest {
protected:
    // Odd, so that nothing rests on halves.
    static constexpr uint32_t wide = 333, tall = 251;

    Picture drawn(const char* backend, double pixel_error, bool smoke) {
        auto session = DrawSession::open(scene_, *renderer_, {backend, "", ""}, false, {});
        EXPECT_TRUE(session);
        (*session)->time = 3;
        (*session)->shows_volumes = smoke;
        Camera camera;
        camera.eye = {1.2f, 1.3f, 3.4f};
        camera.target = {0, 0.4f, 0};
        EXPECT_TRUE((*session)->settle(camera, {.pixel_error = pixel_error}, wide, tall));
        auto picture = renderer_->read_picture();
        EXPECT_TRUE(picture);
        return std::move(*picture);
    }
    // A picture of one colour all around: three mantissas and an exponent.
    void write_hdr(const std::string& name, const std::string& texel) const {
        std::string file = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n";
        for (int i = 0; i < 32; ++i) file += texel;
        std::ofstream(folder_ / name, std::ios::binary) << file;
    }
    void write_scene(const std::string& name, const std::string& environment) const {
        std::ofstream(folder_ / (name + ".scene.json"))
            << R"({"lodestone": "scene", "version": 1, "assets": [{"name": "rock", "file": "rock.ply"}], "environment": ")"
            << environment << "\"}";
    }
    Image rendered(const std::string& options, const std::string& scene = "rock.ply") const {
        succeeds("render " + scene + " --size 96x64 -o out.png " + options);
        auto image = read_image(folder_ / "out.png");
        EXPECT_TRUE(image);
        return image ? *image : Image{1, 1, {glm::u8vec4(0)}};
    }
};

TEST_F(EnvironmentProgramTest, EveryBackendIsLitAlike) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    make_still_life(wide, tall);
    ASSERT_NE(renderer_, nullptr);
    const auto plain = drawn("full", 1, false);
    scene_.materials.environment = std::make_shared<const Environment>(
        make_environment(ClearSky(glm::normalize(glm::vec3(0.1f, 0.9f, -0.4f)), {}), 1));
    const Picture full = drawn("full", 1, false), smoky = drawn("full", 1, true);
    // Surfaces are lit otherwise, and bare pixels show the sky, also from beside smoke.
    const std::vector<uint8_t> all(size_t{wide} * tall, 1), covered = covered_union(full, full);
    EXPECT_LT(psnr_db(full, plain, covered), 40);
    EXPECT_GT(full.colour[2], full.colour[0] + 20) << "the sky is blue";
    // At the side there is no smoke.
    std::vector<uint8_t> side(all.size());
    for (size_t i = 0; i < all.size(); ++i) side[i] = covered[i] == 0 && i % wide < 20 ? 1 : 0;
    EXPECT_GT(std::ranges::count(side, 1), 2000);
    EXPECT_LT(psnr_db(full, plain, side), 20);
    EXPECT_GT(psnr_db(full, smoky, side), 55);
    const struct {
        const char* backend;
        double pixel_error, lit, smoky;
    } others[] = {{"discrete", 0.5, 99, 99}, {"lod", 0.5, 47, 47}, {"vgi", 0.25, 38, 40}};
    for (const auto& other : others) {
        const double lit = psnr_db(drawn(other.backend, other.pixel_error, false), full, all),
                     beside = psnr_db(drawn(other.backend, other.pixel_error, true), smoky, all);
        std::printf("%s: %.1f dB to full, %.1f with smoke\n", other.backend, lit, beside);
        EXPECT_GT(lit, other.lit) << other.backend;
        EXPECT_GT(beside, other.smoky) << other.backend;
    }
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

TEST_F(EnvironmentProgramTest, IsASkyOrAPictureOfSurroundings) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    succeeds("generate rock --triangles 800 -o rock.ply");
    const Image usual = rendered("--backend full"), sky = rendered("--backend full --environment sky");
    EXPECT_NE(usual.texels, sky.texels);
    // 64.5, 128.5 and 0.5 of 256.
    write_hdr("one.hdr", std::string("\x40\x80\0\x80", 4));
    const Image hdr = rendered("--backend vgi --environment one.hdr");
    for (int k = 0; k < 3; ++k) {
        const double linear = (k == 0 ? 64.5 : k == 1 ? 128.5 : 0.5) / 256;
        EXPECT_NEAR(hdr.texels[0][k], 255 * srgb_from_linear(linear), 1) << k;
    }
    // The stone, grey in white light, is lit by it.
    const glm::u8vec4 middle = hdr.texels[size_t{32} * 96 + 48];
    EXPECT_GT(middle.y, middle.x + 10);
}

TEST_F(EnvironmentProgramTest, IsWhatTheSceneSaysUnlessTheOptionDoes) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    succeeds("generate rock --triangles 800 -o rock.ply");
    write_hdr("one.hdr", std::string("\x40\x80\0\x80", 4));
    write_scene("hdr", "one.hdr");
    write_scene("sky", "sky");
    EXPECT_EQ(rendered("", "hdr.scene.json").texels, rendered("--environment one.hdr").texels);
    EXPECT_EQ(rendered("", "sky.scene.json").texels, rendered("--environment sky").texels);
    EXPECT_EQ(rendered("--environment none", "sky.scene.json").texels, rendered("").texels);
    EXPECT_EQ(rendered("--environment sky", "hdr.scene.json").texels, rendered("--environment sky").texels);
    fs::create_directory(folder_ / "inner");
    fs::copy_file(folder_ / "rock.ply", folder_ / "inner/rock.ply");
    write_scene("inner/outside", "../one.hdr");
    fails("render inner/outside.scene.json -o none.png", 3, "../one.hdr");
    succeeds("render inner/outside.scene.json --size 96x64 -o out.png --allow-outside");
}

TEST_F(EnvironmentProgramTest, WhatIsNoneIsToldBeforeAnythingIsBaked) {
    succeeds("generate rock --triangles 200 -o rock.ply");
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    fails("render rock.ply -o out.png --environment none.hdr", 3, "none.hdr");
    fails("render rock.ply -o out.png --environment rock.ply", 3, "rock.ply: is no Radiance picture");
    write_hdr("cut.hdr", "abc");
    fails("render rock.ply -o out.png --environment cut.hdr", 3, "cut.hdr: row 4 of 4 is cut short");
    EXPECT_FALSE(fs::exists(folder_ / "out.png"));
}

}  // namespace
}  // namespace lodestone
