// Voxels that are filled by and by: a share in each frame of a round, seen at its end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "volume/draw/volume_draw.h"

namespace lodestone {
namespace {

using volume::Emitter;

class RoundsTest : public VolumeDrawTest {
protected:
    double figure(const std::string& name) const {
        for (const auto& [key, value] : stats_.more) {
            if (key == name) return value;
        }
        return -1;
    }
    void expect_seen(const std::vector<Pixel>& wanted, const std::string& what) const {
        for (size_t i = 0; i < wanted.size(); ++i) {
            ASSERT_EQ(pixels_[i].through, wanted[i].through) << what << ", pixel " << i;
            ASSERT_EQ(pixels_[i].light, wanted[i].light) << what << ", pixel " << i;
        }
    }
};

Emitter faded_plume() {
    Emitter e = puff();
    e.velocity = {0.1f, 0.3f, 0.05f};
    e.turning = 0.5f;
    e.fade = 0.25f;
    e.particles = 12;
    return e;
}

FrameInput input_at(double time) {
    FrameInput input = look_from({0.4f, 0.7f, 2.4f}, {0.1f, 0.4f, 0});
    input.time = time;
    return input;
}

// Frames come an eighth of a second apart, which is exact, so a round ends at what then is.
TEST_F(RoundsTest, EndAtWhatThenIsAndShowNothingOfItBefore) {
    constexpr uint32_t frames = 13, length = 4;
    std::vector<std::vector<Pixel>> every(frames);
    load({faded_plume()}, {.metavoxels = 8, .voxels = 12});
    for (uint32_t f = 0; f < frames; ++f) {
        draw(input_at(0.125 * f));
        every[f] = pixels_;
    }
    load({faded_plume()}, {.metavoxels = 8, .voxels = 12});
    volumes_->quality.refresh = length;
    double bricks = 0;
    for (uint32_t f = 0; f < frames; ++f) {
        draw(input_at(0.125 * f));
        // The first frame fills all. Of the first round's frames none was before from which to tell how they come, but
        // the one that filled all.
        expect_seen(every[f - f % length], "frame " + std::to_string(f));
        if (f == 0) {
            bricks = figure("bricks");
        } else {
            EXPECT_LE(figure("filled"), 1.3 * bricks / length + 1) << f;
            EXPECT_GT(figure("filled"), 0) << f;
        }
    }
}

TEST_F(RoundsTest, WithoutRoomForTwoSetsAllAreFilledAtOnceAndSaidSo) {
    load({faded_plume()}, {.metavoxels = 8, .voxels = 12});
    draw(input_at(0));
    const auto bytes = static_cast<uint64_t>(figure("brick_bytes"));
    load({faded_plume()}, {.metavoxels = 8, .voxels = 12, .pool_bytes = bytes * 3 / 2});
    volumes_->quality.refresh = 3;
    std::vector<double> filled;
    size_t warned = 0;
    for (uint32_t f = 0; f < 7; ++f) {
        draw(input_at(0.01 * f));
        filled.push_back(figure("filled") / figure("bricks"));
        warned += warnings_.size();
        if (!warnings_.empty()) { EXPECT_THAT(warnings_[0], testing::HasSubstr("pool_mib")); }
    }
    EXPECT_THAT(filled, testing::ElementsAre(1, 0, 0, 1, 0, 0, 1));
    EXPECT_EQ(warned, 1u);
}

// Whatever was under way when the light, the quality or the way changed: once nothing changes any more, it is what it
// is to one that has seen nothing else.
TEST_F(RoundsTest, LeaveNothingBehindWhateverChanges) {
    Random random(4);
    load({faded_plume()}, {.metavoxels = 6, .voxels = 8});
    const auto any_light = [&] { return glm::vec3(random.uniform(-1, 1), -1, random.uniform(-1, 1)); };
    for (int round = 0; round < 12; ++round) {
        FrameInput input = input_at(0);
        for (int f = 0; f < 7; ++f) {
            if (random.uniform(0, 1) < 0.3) input.light_direction = any_light();
            volumes_->quality.refresh = static_cast<uint32_t>(random.uniform(0, 6));
            volumes_->quality.density = random.uniform(0, 1) < 0.2 ? 0.0f : 1.5f;
            volumes_->quality.by_metavoxel = random.uniform(0, 1) < 0.2;
            input.time = random.uniform(0, 20);
            draw(input);
        }
        volumes_->quality = {};
        volumes_->quality.refresh = 2 + static_cast<uint32_t>(round) % 3;
        for (int f = 0; f < 9; ++f) draw(input);
        const auto seen = pixels_;
        load({faded_plume()}, {.metavoxels = 6, .voxels = 8});
        draw(input);
        expect_seen(seen, "round " + std::to_string(round));
    }
}

}  // namespace
}  // namespace lodestone
