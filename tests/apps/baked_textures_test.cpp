// Textures baked into an atlas, through the program, against the pictures of the source.
#include <gtest/gtest.h>

#include <cstdio>

#include "apps/program.h"
#include "fixtures/materials.h"
#include "mesh/generate.h"
#include "mesh/io/image_file.h"
#include "mesh/io/write.h"
#include "report/image_metrics.h"

namespace lodestone {
namespace {

Picture picture_of(const std::filesystem::path& path) {
    auto image = read_image(path);
    EXPECT_TRUE(image) << image.error().message;
    Picture picture{image->width, image->height, {}, {}};
    for (const glm::u8vec4& t : image->texels) picture.colour.insert(picture.colour.end(), {t.x, t.y, t.z, t.w});
    return picture;
}

class BakedTexturesTest : public ProgramTest {
protected:
    void write_scene(const std::string& name, const std::string& file) {
        std::ofstream(folder_ / name) << R"({"lodestone": "scene", "version": 1, "assets": [{"name": "a", "file": ")"
                                      << file << R"("}], "light": {"direction": [-0.1, -0.9, 0.4]}, "camera": {
            "lodestone": "camera-path", "version": 1, "fov_y_degrees": 45, "near": 0.01, "far": 100, "frames": 2,
            "keys": [{"eye": [1.2, 1.3, 3.4], "target": [0, -0.1, 0]}, {"eye": [1.2, 1.3, 3.4], "target": [0, -0.1, 0]}]}})";
    }
    double nearness(const std::string& scene, const std::string& debug) {
        const std::string look = " --size 333x251 --debug " + debug;
        EXPECT_EQ(run("render source.scene.json --backend full -o full.png" + look).code, 0);
        const Ended e = run("render " + scene + " --backend vgi --pixel-error 0.5 --validation -o vgi.png" + look);
        EXPECT_EQ(e.code, 0) << e.err;
        const Picture full = picture_of(folder_ / "full.png"), vgi = picture_of(folder_ / "vgi.png");
        return psnr_db(vgi, full, covered_union(vgi, full));
    }
};

TEST_F(BakedTexturesTest, AreToldWhereThereAreNone) {
    ASSERT_TRUE(write_mesh(generate(Shape::sphere, 500), folder_ / "ball.ply"));
    const Ended bake = run("bake ball.ply -o ball.lode --backends vgi --bake-textures");
    EXPECT_EQ(bake.code, 0);
    EXPECT_NE(bake.err.find("has no textures with texture coordinates"), std::string::npos) << bake.err;
}

TEST_F(BakedTexturesTest, LookAsTheSourceDoes) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    ASSERT_TRUE(write_mesh(fixtures::still_life(), folder_ / "still.glb"));
    const Ended bake = run("bake still.glb -o still.lode --backends vgi --bake-textures");
    ASSERT_EQ(bake.code, 0) << bake.err;
    EXPECT_EQ(run("verify still.lode").code, 0);
    // Of the source's images nothing is left: they are in the atlas.
    EXPECT_EQ(run("info still.lode").out.find("mesh/image"), std::string::npos);
    write_scene("source.scene.json", "still.glb");
    write_scene("baked.scene.json", "still.lode");
    // A decibel or two below what was measured.
    for (const auto& [debug, least] :
         {std::pair("none", 41.0), {"base-colour", 39.0}, {"normal", 37.0}, {"roughness", 34.5}}) {
        const double baked = nearness("baked.scene.json", debug);
        std::printf("%s: %.1f dB\n", debug, baked);
        EXPECT_GT(baked, least) << debug;
    }
}

}  // namespace
}  // namespace lodestone
