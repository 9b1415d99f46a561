// What is left of a mesh from afar, through the program: how it looks against pictures of the source with 16 samples a
// pixel, and with how many triangles.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "apps/program.h"

namespace lodestone {
namespace {

class FarTest : public ProgramTest {
protected:
    struct Looks {
        double ssim, triangles;
    };
    // By backend; six views from all around, of a generated shape that is about two units large.
    std::map<std::string, Looks> seen_from(const std::string& shape, double away) const {
        json keys = json::array();
        for (int k = 0; k < 6; ++k) {
            const double height = 1 - (2 * k + 1) / 6.0, turn = 2.4 * k, aside = std::sqrt(1 - height * height);
            keys.push_back({{"eye", {away * aside * std::cos(turn), away * height, away * aside * std::sin(turn)}},
                            {"target", {0, 0, 0}}});
        }
        const json scene = {
            {"lodestone", "scene"},
            {"version", 1},
            {"assets", {{{"name", "a"}, {"generate", {{"shape", shape}, {"triangles", 60000}, {"seed", 7}}}}}},
            {"camera",
             {{"lodestone", "camera-path"}, {"version", 1}, {"fov_y_degrees", 45}, {"far", 2 * away}, {"keys", keys}}}};
        std::ofstream(folder_ / "far.scene.json") << scene;
        const Ended flown = run(
            "bench far.scene.json --size 320x240 --backends lod,vgi --frames 6 --quality-frames 6 --json -o report");
        EXPECT_EQ(flown.code, 0) << flown.err;
        std::map<std::string, Looks> looks;
        const json rows = json::parse(flown.out)["rows"];
        for (const json& row : rows) {
            looks[row["backend"]] = {row["ssim"], row["triangles"]};
            std::printf("%s, %.0f away, %s: SSIM %.4f, %.0f triangles\n", shape.c_str(), away,
                        row["backend"].get<std::string>().c_str(), row["ssim"].get<double>(),
                        row["triangles"].get<double>());
        }
        return looks;
    }
};

// Triangles of moved corners are lit by the charts that lie where they are drawn.
TEST_F(FarTest, FewTrianglesLookAsTheSourceDoes) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    auto rock = seen_from("rock", 24);
    EXPECT_LT(rock["vgi"].triangles, rock["lod"].triangles);
    EXPECT_GT(rock["vgi"].ssim, rock["lod"].ssim + 0.04);
    // Its walls are nearer to each other than triangles are to either.
    auto vase = seen_from("vase", 48);
    EXPECT_LT(vase["vgi"].triangles, vase["lod"].triangles);
    EXPECT_GT(vase["vgi"].ssim, 0.76);
}

}  // namespace
}  // namespace lodestone
