// Smoke and fire through the program: how they are drawn, what is compared, what is tuned.
#include <cmath>

#include "apps/program.h"
#include "mesh/io/image_file.h"

namespace lodestone {
namespace {

class VolumesProgramTest : public ProgramTest {
protected:
    void SetUp() override {
        ProgramTest::SetUp();
        std::ofstream(folder_ / "s.scene.json") << R"({"lodestone": "scene", "version": 1,
            "assets": [{"name": "a", "generate": {"shape": "rock", "triangles": 2000}}],
            "volumes": [{"position": [0, 0.5, 0], "radius": [0.4, 0.7], "density": 6}],
            "volume_options": {"metavoxels": 8, "voxels": 12}})";
        std::ofstream(folder_ / "without.scene.json") << R"({"lodestone": "scene", "version": 1,
            "assets": [{"name": "a", "generate": {"shape": "rock", "triangles": 2000}}]})";
    }
    Image drawn(const std::string& options) const {
        succeeds("render s.scene.json --size 160x120 --backend full --time 2 --validation -o p.png " + options);
        auto image = read_image(folder_ / "p.png");
        EXPECT_TRUE(image) << options;
        return image ? std::move(*image) : Image{};
    }
    // Decibels between two pictures; 100 where they are equal.
    static double psnr(const Image& a, const Image& b) {
        EXPECT_EQ(a.texels.size(), b.texels.size());
        double sum = 0;
        for (size_t i = 0; i < a.texels.size(); ++i) {
            for (int c = 0; c < 3; ++c) {
                const double d = double(a.texels[i][c]) - double(b.texels[i][c]);
                sum += d * d;
            }
        }
        return sum > 0 ? 10 * std::log10(65025.0 * 3 * static_cast<double>(a.texels.size()) / sum) : 100;
    }
};

TEST_F(VolumesProgramTest, AreDrawnAsTheyAreAskedFor) {
    fails("render s.scene.json -o x.png --volumes 9", 2, "a quality from 1 to 8");
    fails("render s.scene.json -o x.png --volumes maybe", 2, "--volumes maybe");
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    const Image on = drawn(""), off = drawn("--volumes off"), reference = drawn("--volumes reference");
    EXPECT_LT(psnr(on, off), 35) << "smoke is seen";
    EXPECT_GT(psnr(on, reference), 55);
    EXPECT_EQ(psnr(on, drawn("--volumes 8")), 100);
    const double cheap = psnr(on, drawn("--volumes 1"));
    EXPECT_GT(cheap, 35);
    EXPECT_LT(cheap, 100);
    EXPECT_EQ(psnr(drawn("--debug volume-bricks"), drawn("--debug volume-bricks --volumes reference")), 100);
}

TEST_F(VolumesProgramTest, AreComparedAndTuned) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    const std::string small = " --size 96x64 --frames 4 ";
    succeeds("bench s.scene.json --backends full,lod --volumes on,2,reference,off --quality-frames 1 -o b" + small);
    const json report = json::parse(content_of(folder_ / "b/report.json"));
    ASSERT_EQ(report["rows"].size(), 8u);
    const char* ways[] = {"on", "2", "reference", "off"};
    for (size_t r = 0; r < 8; ++r) {
        const json& row = report["rows"][r];
        EXPECT_EQ(row["volumes"], ways[r % 4]);
        EXPECT_EQ(row.contains("volume"), r % 4 != 3) << row;
        if (r % 4 != 3) { EXPECT_GT(row["volume"]["fill_ms"], 0) << row; }
        if (r % 4 != 3) { EXPECT_GT(row["volume"]["march_ms"], 0) << row; }
    }
    EXPECT_THAT(content_of(folder_ / "b/report.md"), HasSubstr("| full volumes reference |"));
    fails("bench without.scene.json --backends full --volumes on,off -o x" + small, 2, "no smoke or fire");

    const json tuned = printed("tune s.scene.json --backend full --turn volumes --fps 1 --json" + small);
    EXPECT_EQ(tuned["volumes"], 8) << "nothing here takes a second";
    EXPECT_TRUE(tuned["holds"]);
    ASSERT_EQ(tuned["tried"].size(), 1u);
    EXPECT_EQ(tuned["tried"][0]["volumes"], 8);
    fails("tune s.scene.json --backend full --turn volumes --fps 100000" + small, 4, "the cheapest smoke and fire");
    fails("tune without.scene.json --turn volumes" + small, 2, "no smoke or fire");
}

}  // namespace
}  // namespace lodestone
