// Smoke beside any backend: what is seen of it does not depend on which one draws the scene.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/drawing/session.h"
#include "apps/drawn_scene.h"
#include "base/statistics.h"

namespace lodestone {
namespace {

class VolumesBackendsTest : public DrawnSceneTest {
protected:
    static constexpr uint32_t width = 240, height = 136;

    // A rock with smoke before, behind and around it.
    void make_smoke() {
        std::ofstream(folder_ / "s.scene.json") << R"({"lodestone": "scene", "version": 1,
            "assets": [{"name": "a", "generate": {"shape": "rock", "triangles": 8000}}],
            "volumes": [{"position": [0, 0, 0], "spread": 1.2, "velocity": [0, 0, 0], "radius": [0.3, 0.6], "density": 3}],
            "volume_options": {"metavoxels": 10, "voxels": 16}})";
        make_ready("s.scene.json", width, height);
    }
    Picture drawn(const Technique& way, const Camera& camera, const Budget& budget) {
        auto session = DrawSession::open(scene_, *renderer_, way, false, {});
        EXPECT_TRUE(session);
        (*session)->time = 3;
        EXPECT_TRUE((*session)->settle(camera, budget, width, height));
        auto picture = renderer_->read_picture();
        EXPECT_TRUE(picture);
        return std::move(*picture);
    }
};

// What a backend draws with smoke and without.
struct Pair {
    Picture with, without;
};

// By how many of 255 steps a channel differs.
int difference(const Picture& a, const Picture& b, size_t pixel) {
    int most = 0;
    for (size_t c = 0; c < 3; ++c)
        most = std::max(most, std::abs(int{a.colour[4 * pixel + c]} - int{b.colour[4 * pixel + c]}));
    return most;
}

// Differences with smoke of pixels whose surfaces are as deep and as bright without it.
std::vector<double> differences(const Pair& a, const Pair& b) {
    std::vector<double> all;
    for (size_t i = 0; i < a.with.depth.size(); ++i) {
        const float deep = a.with.depth[i], other = b.with.depth[i];
        if (std::abs(deep - other) <= 1e-4f * std::max(deep, other) && difference(a.without, b.without, i) == 0)
            all.push_back(difference(a.with, b.with, i));
    }
    return all;
}

TEST_F(VolumesBackendsTest, WhichOneDrawsTheSceneDoesNotShow) {
    if (!has_device()) GTEST_SKIP() << "no Vulkan device; install mesa-vulkan-drivers to run this test";
    make_smoke();
    for (const glm::vec3& eye : {glm::vec3(2.5f, 1.2f, 2), glm::vec3(-0.5f, -0.3f, 2.2f)}) {
        Camera camera;
        camera.eye = eye;
        const auto both = [&](const char* backend, const Budget& budget) {
            return Pair{drawn({backend, "", ""}, camera, budget), drawn({backend, "", "", "off"}, camera, budget)};
        };
        const Pair full = both("full", {});
        size_t smoky = 0;
        for (size_t i = 0; i < full.with.depth.size(); ++i) smoky += difference(full.with, full.without, i) > 20;
        EXPECT_GT(smoky, width * height / 8);
        // The same triangles: the same depths and the same shadow map, so the same smoke to the last bit.
        const Pair same = both("discrete", {.forced_level = 0});
        EXPECT_EQ(same.with.depth, full.with.depth);
        EXPECT_EQ(same.with.colour, full.with.colour);
        for (const char* backend : {"discrete", "lod", "vgi"}) {
            const auto agreeing = differences(full, both(backend, {.pixel_error = 1}));
            const double worst = percentile(agreeing, 0.999);
            std::printf("%s at a pixel against full, %zu of %u pixels agree: 99.9th percentile %g / 255, worst %g\n",
                        backend, agreeing.size(), width * height, worst, percentile(agreeing, 1));
            EXPECT_GT(agreeing.size(), size_t{width} * height / 2);
            EXPECT_LE(worst, 1);
        }
    }
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

}  // namespace
}  // namespace lodestone
