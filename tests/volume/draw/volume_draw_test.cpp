// Volumes on whatever device is there, against a marcher on the CPU that shares no code with them (analytic.h).
#include "volume/volume_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <glm/geometric.hpp>
#include <glm/packing.hpp>

#include "base/random.h"
#include "baseline/fixed_levels.h"
#include "baseline/full.h"
#include "fixtures/meshes.h"
#include "frame/plan_mirror.h"
#include "mesh/io/image_file.h"
#include "mesh/packed_vertices.h"
#include "mesh/repair.h"
#include "render/device_test.h"
#include "shaders/shared/light_grid.h"
#include "shaders/shared/volume.h"
#include "volume/draw/volume_draw.h"

namespace lodestone {
namespace {

using volume::ColourBy;
using volume::Emitter;
using volume::VolumeOptions;
using volume::VolumeSource;

TEST_F(VolumeDrawTest, APuffIsWhatTheReferenceSaysItIs) {
    double before = 0;
    for (const uint32_t across : {4u, 8u}) {
        load({puff()}, {.metavoxels = across, .voxels = 30});
        const FrameInput input = look_from({0.4f, 0.5f, 2});
        draw(input);
        save("puff");
        const AnalyticVolume reference({puff()}, 0, {}, 0.01);
        const double psnr = psnr_to(reference, input.views[0]);
        std::printf("%u^3: %.1f dB, %g bricks\n", across * 30, psnr, stats_.more[0].second);
        EXPECT_GT(psnr, before + 3);
        before = psnr;
    }
    EXPECT_GT(before, 40);
}

// The share that a ray lets through, of a uniform ball: by the length of its chord.
double through_ball(const View& view, double x, double y, double density, double radius, double depth = 1e9) {
    const glm::dmat3 rows(glm::dmat4(view.world_to_view));
    const glm::dvec3 in_view(x / double(view.focal_px), -y / double(view.focal_px), -1);
    const glm::dvec3 along = glm::transpose(rows) * in_view, eye(view.eye);
    const double squared = glm::dot(along, along), middle = -glm::dot(eye, along) / squared;
    const double half = radius * radius - glm::dot(eye, eye) + middle * middle * squared;
    if (half <= 0) return 1;
    const double begin = std::max(middle - std::sqrt(half / squared), 0.0);
    const double end = std::min(middle + std::sqrt(half / squared), depth);
    return std::exp(-density * std::max(0.0, end - begin) * std::sqrt(squared));
}

TEST_F(VolumeDrawTest, ABallLetsThroughWhatItsChordsSay) {
    load({ball(3)}, {.metavoxels = 6, .voxels = 32});
    const FrameInput input = look_from({0, 0, 2});
    draw(input);
    EXPECT_NEAR(centre().through, through_ball(input.views[0], 0.5, 0.5, 3, 0.4), 0.004);
    EXPECT_EQ(pixels_[0].through, 1);
    EXPECT_EQ(pixels_[0].light, glm::vec3(0));
}

// Steps of equal view depth are longer away from the axis: left out, a ray to the corner of a wide view counts a third
// too little.
TEST_F(VolumeDrawTest, InTheCornerOfAWideViewItIsAsDenseAsInTheMiddle) {
    load({ball(3)}, {.metavoxels = 4, .voxels = 32});
    Camera camera;
    camera.fov_y = 1.0471976f;
    camera.near_plane = 0.05f;
    camera.far_plane = 20;
    // The ball stands in the upper left corner.
    camera.eye = {1.9f, -1.05f, 2};
    camera.target = camera.eye - glm::vec3(0, 0, 1);
    FrameInput input = look_from({0, 0, 2});
    input.views[0] = view_of(camera, width, height);
    draw(input);
    int compared = 0;
    for (uint32_t y = 0; y < 12; ++y) {
        for (uint32_t x = 0; x < 16; ++x) {
            const double expected = through_ball(input.views[0], x + 0.5 - width / 2.0, y + 0.5 - height / 2.0, 3, 0.4);
            if (expected > 0.35) continue;  // off the rim
            EXPECT_NEAR(pixels_[size_t{y} * width + x].through, expected, 0.012) << x << ", " << y;
            ++compared;
        }
    }
    EXPECT_GT(compared, 5);
}

// 1 / (1 + density) a step gives 0.5 for an optical depth of 1 in one step, and 0.39 in eight; the exponential gives
// 0.368 in any.
TEST_F(VolumeDrawTest, WhatShinesThroughDoesNotDependOnStepsUnlessItIsRational) {
    load({ball(1.25f)}, {.metavoxels = 4, .voxels = 32});  // an optical depth of 1 through the middle
    const FrameInput input = look_from({0, 0, 2});
    double exponential[2], rational[2];
    for (int fine = 0; fine < 2; ++fine) {
        volumes_->quality.steps = fine != 0 ? 1.0f : 0.125f;
        volumes_->quality.absorption = volume::Absorption::exponential;
        draw(input);
        exponential[fine] = double(centre().through);
        volumes_->quality.absorption = volume::Absorption::rational;
        draw(input);
        rational[fine] = double(centre().through);
    }
    EXPECT_NEAR(exponential[0], 0.368, 0.02);
    EXPECT_NEAR(exponential[1], 0.368, 0.004);
    const double step = double(volumes_->lattice().voxel) / 0.125;
    EXPECT_NEAR(rational[0], std::pow(1 + 1.25 * step, -0.8 / step), 0.02);
    EXPECT_GT(rational[0], exponential[0] + 0.01);
    EXPECT_GT(rational[0], rational[1] + 0.01);
}

// A wall in the ball ends rays within a step, wherever it stands.
TEST_F(VolumeDrawTest, RaysEndAtTheSceneWithinAStep) {
    double before = 0;
    for (int k = -2; k <= 2; ++k) {
        const float z = 0.013f * static_cast<float>(k);
        const TriMesh wall = plate({0, 0, z}, {2, 0, 0}, {0, 2, 0});
        load({ball(3)}, {.metavoxels = 2, .voxels = 16}, &wall);
        const FrameInput input = look_from({0, 0, 2});
        draw(input);
        const double through = double(centre().through);
        EXPECT_NEAR(through, through_ball(input.views[0], 0.5, 0.5, 3, 0.4, 2 - double(z)), 0.02);
        EXPECT_GT(through, before + 0.005) << "each wall nearer than the one before leaves more";
        before = through;
    }
}

TEST_F(VolumeDrawTest, NothingIsSeenOfWhatStandsBehindTheScene) {
    for (const float z : {0.6f, 1.9f}) {
        const TriMesh wall = plate({0, 0, z}, {2, 0, 0}, {0, 2, 0});
        load({ball(30)}, {.metavoxels = 2, .voxels = 16}, &wall);
        for (const uint32_t divisor : {1u, 2u}) {
            volumes_->quality.divisor = divisor;
            draw(look_from({0, 0, 2}));
            for (const Pixel& p : pixels_) ASSERT_EQ(p.through, 1);
        }
    }
}

TEST_F(VolumeDrawTest, TheEyeMayBeInside) {
    load({ball(2)}, {.metavoxels = 4, .voxels = 32});
    const FrameInput input = look_from({0.1f, 0.05f, 0.2f}, {1, 0, -1});
    draw(input);
    int compared = 0;
    for (uint32_t y = 0; y < height; y += 3) {
        for (uint32_t x = 0; x < width; x += 3) {
            // The near plane takes a little away.
            const double expected = through_ball(input.views[0], x + 0.5 - width / 2.0, y + 0.5 - height / 2.0, 2, 0.4);
            EXPECT_NEAR(pixels_[size_t{y} * width + x].through, expected * std::exp(2 * 0.055), 0.02);
            ++compared;
        }
    }
    EXPECT_GT(compared, 500);
}

TEST_F(VolumeDrawTest, SkippingWhatIsEmptyChangesNothing) {
    load({puff()}, {.metavoxels = 8, .voxels = 16});
    const FrameInput input = look_from({0.4f, 0.5f, 2});
    draw(input);
    const auto skipped = pixels_;
    volumes_->quality.skips_empty = false;
    draw(input);
    for (size_t i = 0; i < pixels_.size(); ++i) {
        ASSERT_NEAR(pixels_[i].through, skipped[i].through, 1e-3) << i;
        ASSERT_NEAR(glm::distance(pixels_[i].light, skipped[i].light), 0, 1e-3) << i;
    }
}

// Samples lie on one lattice for all metavoxels, so it does not show how many there are.
TEST_F(VolumeDrawTest, HowItIsDividedDoesNotShow) {
    load({puff()}, {.metavoxels = 4, .voxels = 32});
    const FrameInput input = look_from({0.4f, 0.5f, 2});
    draw(input);
    const auto whole = pixels_;
    for (const auto& [metavoxels, voxels] : {std::pair(8u, 16u), std::pair(16u, 8u)}) {
        load({puff()}, {.metavoxels = metavoxels, .voxels = voxels});
        draw(input);
        double largest = 0;
        for (size_t i = 0; i < pixels_.size(); ++i) {
            largest = std::max(largest, double(std::abs(pixels_[i].through - whole[i].through)));
            largest = std::max(largest, double(glm::distance(pixels_[i].light, whole[i].light)));
        }
        EXPECT_LT(largest, 0.004) << metavoxels;
    }
}

TEST_F(VolumeDrawTest, APoolInPiecesHoldsTheSame) {
    load({puff()}, {.metavoxels = 8, .voxels = 16});
    const FrameInput input = look_from({0.4f, 0.5f, 2});
    draw(input);
    const auto whole = pixels_;
    const double bytes = stats_.more[2].second;
    renderer_.reset();
    RendererOptions options;
    options.segment_bytes_limit = static_cast<uint32_t>(bytes / 3);
    make(options);
    // As small a pool as does, so that it fits eight pieces.
    load({puff()}, {.metavoxels = 8, .voxels = 16, .pool_bytes = static_cast<uint64_t>(1.3 * bytes)});
    draw(input);
    for (size_t i = 0; i < pixels_.size(); ++i) {
        ASSERT_EQ(pixels_[i].through, whole[i].through) << i;
        ASSERT_EQ(pixels_[i].light, whole[i].light) << i;
    }
}

TEST_F(VolumeDrawTest, FireAndTablesAreWhatTheReferenceSaysTheyAre) {
    Emitter fire = puff(), banded = puff();
    fire.look = volume::fire_look();
    banded.position = {0.3f, 0, 0};
    banded.look.density_from = banded.look.density_to = 8;
    banded.look.table = {{0.9f, 0.2f, 0.1f, 1}, {0.1f, 0.9f, 0.2f, 0.6f}, {0.2f, 0.1f, 0.9f, 0}};
    const std::vector<Emitter> both{fire, banded};
    load(both, {.metavoxels = 8, .voxels = 24});
    const FrameInput input = look_from({0.4f, 0.5f, 2.2f});
    draw(input);
    save("fire");
    const double psnr = psnr_to(AnalyticVolume(both, 0, {}, 0.01), input.views[0]);
    std::printf("two that overlap, fire and a table: %.1f dB\n", psnr);
    EXPECT_GT(psnr, 40);
}

// What reaches receivers, everywhere around a puff, in it and behind it.
TEST_F(VolumeDrawTest, TheLightBehindAndInItIsWhatTheReferenceSays) {
    load({puff()}, {.metavoxels = 8, .voxels = 30});
    FrameInput input = look_from({0.4f, 0.5f, 2});
    Plan plan = volumes_->plan(input);
    const uint64_t bytes = volumes_->recipe().buffers[LODE_VOLUME_LIGHT].bytes;
    plan.commands.push_back({Stage::composite, Readback{LODE_VOLUME_LIGHT, 0, bytes, 1}});
    ASSERT_TRUE(renderer_->submit(Plan{}, input, {}, 0, &plan));
    ASSERT_TRUE(renderer_->wait());
    const auto read = renderer_->take_effect_readbacks();
    ASSERT_EQ(read.size(), 1u);
    std::vector<uint32_t> words(bytes / 4);
    std::memcpy(words.data(), read[0].blob.data(), bytes);
    const auto real = [&](uint32_t k) { return double(std::bit_cast<float>(words[k])); };
    const AnalyticVolume reference({puff()}, 0, {}, 0.01);
    Random random(2);
    double sum = 0, worst = 0, darkest = 1;
    constexpr int places = 2000;
    for (int i = 0; i < places; ++i) {
        const glm::dvec3 world(random.uniform(-0.8, 0.6), random.uniform(-0.9, 0.5), random.uniform(-0.8, 0.6));
        glm::dvec3 p;
        for (uint32_t r = 0; r < 3; ++r)
            p[int(r)] = real(4 * r) * world.x + real(4 * r + 1) * world.y + real(4 * r + 2) * world.z + real(4 * r + 3);
        glm::dvec3 found(1);
        const glm::dvec3 last(words[12] - 1, words[13] - 1, words[14] - 1);
        if (p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x <= last.x && p.y <= last.y) {
            p.z = std::min(p.z, last.z);
            found = glm::dvec3(0);
            const glm::uvec3 low(glm::min(glm::floor(p), last - 1.0));
            for (uint32_t k = 0; k < 8; ++k) {
                const glm::uvec3 at = low + glm::uvec3(k & 1, k >> 1 & 1, k >> 2);
                const glm::dvec3 w = 1.0 - glm::abs(p - glm::dvec3(at));
                const uint32_t word = words[LODE_LIGHT_GRID_HEAD + (at.z * words[13] + at.y) * words[12] + at.x];
                found += w.x * w.y * w.z * glm::dvec3(word & 1023, word >> 10 & 1023, word >> 20 & 1023) / 1023.0;
            }
        }
        const glm::dvec3 d = glm::abs(found - reference.light_at(world));
        sum += (d.x + d.y + d.z) / 3;
        worst = std::max({worst, d.x, d.y, d.z});
        darkest = std::min(darkest, found.x);
    }
    std::printf("light at receivers: error %.4f, at worst %.4f, darkest %.2f\n", sum / places, worst, darkest);
    EXPECT_LT(sum / places, 0.003);
    EXPECT_LT(worst, 0.08);
    EXPECT_LT(darkest, 0.5) << "some places are in deep shadow";
}

ShadingOptions from_above() {
    ShadingOptions look;
    look.light_direction = {0, -1, 0};
    return look;
}

FrameInput lit_from_above(const glm::vec3& eye) {
    FrameInput input = look_from(eye);
    input.light_direction = {0, -1, 0};
    input.views[1] = shadow_view({0, -1, 0}, {0, 0, 0}, 3, 512);
    return input;
}

TEST_F(VolumeDrawTest, TheSceneShadowsIt) {
    // Over the left half.
    const TriMesh roof = plate({-1, 1, 0}, {1, 0, 0}, {0, 0, 1});
    load({ball(40)}, {.metavoxels = 4, .voxels = 32}, &roof);
    const ShadingOptions look = from_above();
    const FrameInput input = lit_from_above({0, 0.6f, 2});
    draw(input, look);
    save("scene-shadows-volume");
    const glm::vec3 around = 0.5f * (look.sky_colour + look.ground_colour);
    const auto brightness = [&](int dx) {
        // On the upper side of the ball, beside the middle.
        const Pixel& p = pixels_[size_t{height / 2 - 7} * width + width / 2 + static_cast<size_t>(dx)];
        EXPECT_LT(p.through, 0.05f);
        return p.light.x / 0.9f;
    };
    EXPECT_NEAR(brightness(-6), around.x, 0.05 * double(around.x)) << "in shadow there is what comes from around";
    EXPECT_GT(brightness(5), around.x + 0.04f);
}

TEST_F(VolumeDrawTest, ItShadowsTheSceneInItsColour) {
    const TriMesh floor = plate({0, -0.8f, 0}, {2, 0, 0}, {0, 0, -2});
    Emitter red = ball(2);
    red.look.colour_from = red.look.colour_to = {0.95f, 0.2f, 0.1f};
    load({red}, {.metavoxels = 4, .voxels = 32}, &floor);
    ShadingOptions look = from_above();
    look.sky_colour = look.ground_colour = glm::vec3(0);
    // The eye looks under the ball, at where its shadow lies.
    FrameInput input = lit_from_above({0, -0.62f, 1.2f});
    Camera camera;
    camera.eye = {0, -0.5f, 1.2f};
    camera.target = {0, -0.8f, 0};
    camera.near_plane = 0.05f;
    camera.far_plane = 20;
    input.views[0] = view_of(camera, width, height);
    draw(input, look);
    save("volume-shadows-scene");
    const auto shadowed = picture_;
    volumes_->quality.density = 0;
    draw(input, look);
    const size_t middle = 4 * (size_t{height / 2} * width + width / 2);
    const auto linear = [](uint8_t v) { return std::pow((v / 255.0 + 0.055) / 1.055, 2.4); };
    // In the middle of the shadow light has come through all of the ball.
    for (size_t c = 0; c < 3; ++c) {
        const double share = linear(shadowed.colour[middle + c]) / linear(picture_.colour[middle + c]);
        const double takes = 2 * (1 - 0.5 * double(red.look.colour_from[static_cast<int>(c)]));
        EXPECT_NEAR(share, std::exp(-0.8 * takes), 0.03) << c;
    }
    EXPECT_EQ(shadowed.colour[4 * (size_t{height - 1} * width)], picture_.colour[4 * (size_t{height - 1} * width)])
        << "beside it nothing changes";
}

// Without emission no ray brings more than what arrives, and light only grows less on its way.
TEST_F(VolumeDrawTest, NoMoreLightComesOutThanGoesIn) {
    Emitter white = puff();
    white.look.colour_from = white.look.colour_to = glm::vec3(1);
    load({white}, {.metavoxels = 6, .voxels = 24});
    draw(look_from({0.4f, 0.5f, 2}));
    const ShadingOptions look;
    const glm::vec3 most = 0.5f * (look.sky_colour + look.ground_colour) + 0.5f * look.light_colour / (4 * 3.14159265f);
    for (const Pixel& p : pixels_) {
        for (int c = 0; c < 3; ++c) ASSERT_LE(p.light[c], (1 - p.through) * most[c] * 1.01f + 0.002f);
    }
}

TEST_F(VolumeDrawTest, ASmallerTargetShowsTheSameWithoutCracks) {
    const TriMesh cube = fixtures::cube_with_seams();
    Emitter cloud = puff();
    cloud.position = {0.4f, 0.3f, 0.6f};
    cloud.look.density_from = 12;
    for (const uint32_t divisor : {2u, 3u, 4u}) {
        load({cloud}, {.metavoxels = 8, .voxels = 16}, &cube);
        const FrameInput input = look_from({1.1f, 0.9f, 1.5f}, {0.4f, 0.3f, 0.5f});
        draw(input);
        save("full-target");
        const auto full = pixels_;
        volumes_->quality.divisor = divisor;
        draw(input);
        save("smaller-target");
        double sum = 0;
        size_t count = 0, off = 0;
        for (size_t i = 0; i < full.size(); ++i) {
            if (full[i].through >= 0.999f && pixels_[i].through >= 0.999f) continue;
            const double through = double(pixels_[i].through - full[i].through);
            const glm::dvec3 d = glm::dvec3(pixels_[i].light) - glm::dvec3(full[i].light);
            sum += through * through + glm::dot(d, d);
            count += 4;
            off += std::abs(through) > 0.05 ? 1 : 0;
        }
        const double psnr = 10 * std::log10(static_cast<double>(count) / sum);
        std::printf("1/%u: %.1f dB, %zu of %zu pixels off by more than 5%%\n", divisor, psnr, off, count / 4);
        // Half the size loses nothing that is seen; less loses what lies between its taps.
        EXPECT_GT(psnr, divisor == 2 ? 45 : 40);
        EXPECT_LE(off, divisor == 2 ? 0 : count / 4 / 50);
    }
}

TEST_F(VolumeDrawTest, WhereThereIsNothingOfItPicturesAreAsWithoutIt) {
    const TriMesh cube = fixtures::cube_with_seams();
    load({ball(3)}, {.metavoxels = 2, .voxels = 16}, &cube);
    const FrameInput input = look_from({1.2f, 1.5f, 3});
    volumes_->quality.density = 0;
    draw(input);
    const Picture without = picture_;
    // Behind the eye, where it shadows nothing: colours are half floats until the end.
    Emitter away = ball(3);
    away.position = {8, 8, 8};
    load({away}, {.metavoxels = 2, .voxels = 16}, &cube);
    draw(input);
    ASSERT_FALSE(volumes_->bins().bricks.empty());
    for (size_t i = 0; i < without.colour.size(); ++i)
        ASSERT_NEAR(without.colour[i], picture_.colour[i], 1) << "pixel " << i / 4;
    EXPECT_EQ(without.depth, picture_.depth);
}

class VolumeWholeTest : public VolumeDrawTest {
protected:
    void expect_to_be_whole(int cameras);
};

void VolumeWholeTest::expect_to_be_whole(int cameras) {
    Emitter moving = puff();
    moving.velocity = {0.05f, 0.1f, 0};
    moving.fade = 0.2f;
    moving.particles = 8;
    const TriMesh cube = fixtures::cube_with_seams();
    load({moving}, {.metavoxels = 5, .voxels = 12}, &cube);
    Random random(9);
    const auto anywhere = [&](double reach) {
        return glm::vec3(random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach));
    };
    for (int i = 0; i < cameras; ++i) {
        FrameInput input = look_from(anywhere(i % 2 == 0 ? 0.5 : 2.5), anywhere(0.5));
        input.time = random.uniform(-5, 50);
        volumes_->quality.divisor = 1 + static_cast<uint32_t>(i) % 3;
        draw(input);
        for (const Pixel& p : pixels_) {
            ASSERT_TRUE(p.through >= 0 && p.through <= 1) << i;
            ASSERT_TRUE(p.light.x >= 0 && p.light.x < 1 && p.light.y >= 0 && p.light.z >= 0) << i;
        }
    }
}

TEST_F(VolumeWholeTest, FromAnyPlaceAtAnyTimeItIsWhole) { expect_to_be_whole(200); }

using VolumeDrawLong = VolumeWholeTest;
TEST_F(VolumeDrawLong, FromAnyPlaceAtAnyTimeItIsWhole) { expect_to_be_whole(1000); }

TEST_F(VolumeDrawTest, EqualFramesGiveEqualPictures) {
    std::vector<Pixel> first;
    for (int round = 0; round < 2; ++round) {
        load({puff()}, {.metavoxels = 6, .voxels = 16});
        volumes_->quality.divisor = 2;
        draw(look_from({0.4f, 0.5f, 2}));
        if (round == 0) first = pixels_;
    }
    for (size_t i = 0; i < first.size(); ++i) {
        ASSERT_EQ(first[i].through, pixels_[i].through);
        ASSERT_EQ(first[i].light, pixels_[i].light);
    }
}

}  // namespace
}  // namespace lodestone
