// The source's own way to draw volumes, metavoxel by metavoxel, against a march through all of them at once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <glm/geometric.hpp>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "shaders/shared/volume.h"
#include "volume/draw/volume_draw.h"

namespace lodestone {
namespace {

using volume::Emitter;

class ByMetavoxelTest : public VolumeDrawTest {
protected:
    // Draws it both ways.
    void draw_both(const FrameInput& input) {
        volumes_->quality.by_metavoxel = false;
        draw(input);
        whole_ = pixels_;
        volumes_->quality.by_metavoxel = true;
        draw(input);
    }
    // Decibels between the two, of pixels where there is something.
    double psnr() const {
        double sum = 0, count = 0;
        for (size_t i = 0; i < pixels_.size(); ++i) {
            if (whole_[i].through >= 0.999f) continue;
            const double d = double(glm::distance(pixels_[i].light, whole_[i].light));
            const double t = double(pixels_[i].through) - double(whole_[i].through);
            sum += d * d + t * t;
            count += 4;
        }
        return count > 0 ? 10 * std::log10(count / std::max(sum, 1e-20)) : 200;
    }
    // The words of the light grid, of a frame.
    std::vector<uint32_t> light_grid(const FrameInput& given) {
        FrameInput input = given;
        input.frame = frame_++;
        Plan plan = volumes_->plan(input);
        const uint64_t bytes = volumes_->recipe().buffers[LODE_VOLUME_LIGHT].bytes;
        plan.commands.push_back({Stage::composite, Readback{LODE_VOLUME_LIGHT, 0, bytes, 1}});
        EXPECT_TRUE(renderer_->submit(Plan{}, input, {}, 0, &plan));
        EXPECT_TRUE(renderer_->wait());
        const auto read = renderer_->take_effect_readbacks();
        std::vector<uint32_t> words(bytes / 4);
        if (read.size() == 1) std::memcpy(words.data(), read[0].blob.data(), bytes);
        return words;
    }
    std::vector<Pixel> whole_;
};

TEST_F(ByMetavoxelTest, ShowsWhatAMarchThroughAllShows) {
    Emitter thick = puff();
    thick.look.density_from = 15;
    double least = 1e9;
    for (const Emitter& emitter : {puff(), thick}) {
        load({emitter}, {.metavoxels = 8, .voxels = 16});
        for (const volume::Absorption absorption : {volume::Absorption::exponential, volume::Absorption::rational}) {
            volumes_->quality.absorption = absorption;
            // From the side, from where the light comes, against it, and from inside.
            for (const glm::vec3& eye : {glm::vec3(0.4f, 0.5f, 2), glm::vec3(0.6f, 2, 0.5f),
                                         glm::vec3(-0.6f, -2, -0.5f), glm::vec3(0.05f, 0.1f, 0.2f)}) {
                draw_both(look_from(eye));
                save("by-metavoxel");
                least = std::min(least, psnr());
                EXPECT_GT(psnr(), 60) << eye.x << ", " << eye.y << ", " << eye.z;
            }
        }
    }
    std::printf("metavoxel by metavoxel against all at once: %.1f dB at least\n", least);
}

TEST_F(ByMetavoxelTest, EndsAtTheSceneAsTheOtherDoes) {
    const TriMesh cube = fixtures::cube_with_seams();
    Emitter cloud = puff();
    cloud.position = {0.4f, 0.3f, 0.6f};
    load({cloud}, {.metavoxels = 8, .voxels = 16}, &cube);
    draw_both(look_from({1.1f, 0.9f, 1.5f}, {0.4f, 0.3f, 0.5f}));
    EXPECT_GT(psnr(), 60);
}

TEST_F(ByMetavoxelTest, HowManyAreFilledAtATimeDoesNotShow) {
    load({puff()}, {.metavoxels = 8, .voxels = 12});
    const FrameInput input = look_from({0.4f, 0.9f, 1.2f});
    draw_both(input);
    const auto all = pixels_;
    for (const uint32_t cache : {1u, 5u, 17u}) {
        volumes_->quality.cache = cache;
        draw(input);
        for (size_t i = 0; i < all.size(); ++i) {
            ASSERT_EQ(pixels_[i].through, all[i].through) << cache;
            ASSERT_EQ(pixels_[i].light, all[i].light) << cache;
        }
    }
}

TEST_F(ByMetavoxelTest, LightsAndShadowsAlike) {
    load({puff()}, {.metavoxels = 8, .voxels = 12});
    const FrameInput input = look_from({0.4f, 0.5f, 2});
    const auto whole = light_grid(input);
    load({puff()}, {.metavoxels = 8, .voxels = 12});
    volumes_->quality.by_metavoxel = true;
    volumes_->quality.cache = 7;
    EXPECT_EQ(light_grid(input), whole);
}

TEST_F(ByMetavoxelTest, DrawsFinelyWhatThePoolDoesNotHold) {
    const FrameInput input = look_from({0.4f, 0.5f, 2});
    load({puff()}, {.metavoxels = 8, .voxels = 16});
    draw(input);
    whole_ = pixels_;
    const double bricks = stats_.more[0].second;
    load({puff()}, {.metavoxels = 8, .voxels = 16, .pool_bytes = 8 * 4 * 17 * 17 * 17});
    volumes_->quality.by_metavoxel = true;
    draw(input);
    EXPECT_THAT(warnings_, testing::IsEmpty());
    EXPECT_EQ(stats_.more[0].second, bricks);
    EXPECT_GT(bricks, 24) << "the pool holds eight of them";
    EXPECT_GT(psnr(), 60);
    volumes_->quality.by_metavoxel = false;
    draw(input);
    ASSERT_THAT(warnings_, testing::SizeIs(1));
    EXPECT_THAT(warnings_[0], testing::HasSubstr("--volumes reference"));
}

TEST_F(ByMetavoxelTest, FromAnyPlaceAtAnyTimeItIsWhatTheOtherIs) {
    Emitter moving = puff();
    moving.velocity = {0.05f, 0.1f, 0};
    moving.fade = 0.2f;
    moving.particles = 8;
    load({moving}, {.metavoxels = 5, .voxels = 12});
    Random random(9);
    const auto anywhere = [&](double reach) {
        return glm::vec3(random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach));
    };
    for (int i = 0; i < 40; ++i) {
        FrameInput input = look_from(anywhere(i % 2 == 0 ? 0.5 : 2.5), anywhere(0.5));
        input.time = random.uniform(-5, 50);
        input.light_direction = anywhere(1) + glm::vec3(0, -1.5f, 0);
        volumes_->quality.cache = static_cast<uint32_t>(i) % 9;
        draw_both(input);
        EXPECT_GT(psnr(), 55) << i;
    }
}

}  // namespace
}  // namespace lodestone
