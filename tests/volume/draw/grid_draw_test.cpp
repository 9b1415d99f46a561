// Density grids on whatever device is there, against the marcher of analytic.h, which knows none: a grid of what a
// particle is must look like that particle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "volume/draw/volume_draw.h"
#include "volume/grids.h"

namespace lodestone {
namespace {

using volume::Emitter;

// The ball as a grid of so many voxels across: what the look's density is times value(share of the radius).
template <class Value>
Emitter grid_of_ball(const Emitter& ball, uint32_t across, Value&& value) {
    Emitter e;
    e.look = ball.look;
    e.particles = 1;
    e.position = ball.position;
    const float radius = ball.radius_from, voxel = 2 * radius / static_cast<float>(across - 3);
    const glm::mat4 map = glm::scale(glm::translate(glm::mat4(1), glm::vec3(-radius - voxel)), glm::vec3(voxel));
    e.grid = std::make_shared<volume::DensityGrid>(volume::grid_of(glm::uvec3(across), map, [&](const glm::uvec3& v) {
        return value(glm::length(glm::vec3(map * glm::vec4(v, 1))) / radius);
    }));
    return e;
}

TEST_F(VolumeDrawTest, AGridOfABallLetsThroughWhatItsChordsSay) {
    constexpr uint32_t across = 67;
    const auto full = [](float share) { return std::clamp((1 - share) * 32 + 0.5f, 0.0f, 1.0f); };  // a smooth rim
    load({grid_of_ball(ball(3), across, full)}, {.metavoxels = 6, .voxels = 32});
    AnalyticVolume reference({ball(3)}, 0, {}, 0.002);
    reference.lit = false;
    const FrameInput input = look_from({0, 0, 2});
    draw(input);
    save("grid-ball");
    double worst = 0;
    for (uint32_t y = 0; y < height; ++y) {
        for (uint32_t x = 0; x < width; ++x) {
            const double expected = reference.march(input.views[0], x, y, 1e9).through;
            if (expected > 0.3) continue;  // off the rim
            worst = std::max(worst, std::abs(double(pixels_[size_t{y} * width + x].through) - expected));
        }
    }
    std::printf("worst of what shines through: %.4f\n", worst);
    EXPECT_LT(worst, 0.01);
    EXPECT_EQ(pixels_[0].through, 1);
    EXPECT_EQ(pixels_[0].light, glm::vec3(0));
}

// Density falls from the centre to the surface, and colour goes with it, of the particle by the radius and of the grid
// by its values. A table, emission and another particle in the same place are summed up alike.
TEST_F(VolumeDrawTest, AGridOfAParticleIsThatParticle) {
    Emitter one = ball(5);
    one.look.colour_by = volume::ColourBy::radius;
    one.look.density_to = 0;
    one.look.colour_to = {0.1f, 0.3f, 0.9f};
    one.position = {0.1f, 0.05f, -0.1f};
    for (const bool table : {false, true}) {
        if (table) {
            one.look.table = {{1, 0.2f, 0.1f, 1}, {0.2f, 0.9f, 0.1f, 0.8f}, {0.1f, 0.2f, 1, 0.6f}};
            one.look.emission = 0.3f;
        }
        Emitter grid = grid_of_ball(one, 99, [](float share) { return std::max(0.0f, 1 - share); });
        grid.look.density_to = grid.look.density_from;
        const FrameInput input = look_from({0.4f, 0.5f, 2});
        const AnalyticVolume reference({one, puff()}, 0, {}, 0.01);
        load({grid, puff()}, {.metavoxels = 6, .voxels = 32});
        draw(input);
        save(table ? "grid-table" : "grid-particle");
        const double psnr = psnr_to(reference, input.views[0]);
        std::printf("grid of 96 voxels across, to the reference of the particle: %.1f dB\n", psnr);
        EXPECT_GT(psnr, 45);
    }
}

// A ball that lies aside in its grid, so that turns, scales and mirrored axes would be seen.
TEST_F(VolumeDrawTest, AGridStandsWhereItIsPut) {
    Emitter grid = ball(6, 0.2f);
    grid.look.colour_to = grid.look.colour_from;
    const glm::vec3 middle(0.5f, 0.1f, -0.3f);
    const glm::mat4 map =
        glm::scale(glm::translate(glm::mat4(1), glm::vec3(0, -0.4f, -0.8f)), glm::vec3(0.01f, 0.02f, 0.01f));
    grid.grid = std::make_shared<volume::DensityGrid>(volume::grid_of({80, 50, 100}, map, [&](const glm::uvec3& v) {
        const float away = glm::distance(glm::vec3(map * glm::vec4(v, 1)), middle);
        return std::clamp((0.2f - away) / 0.015f + 0.5f, 0.0f, 1.0f);
    }));
    grid.particles = 1;
    grid.grid_scale = 1.5f;
    grid.grid_turn = glm::angleAxis(1.2f, glm::normalize(glm::vec3(0.2f, 1, -0.4f)));
    grid.position = {-0.2f, 0.1f, 0.2f};
    Emitter same = ball(6, 0.3f);
    same.position = grid.position + 1.5f * (grid.grid_turn * middle);
    load({grid}, {.metavoxels = 6, .voxels = 32});
    const FrameInput input = look_from({0.4f, 0.5f, 3});
    draw(input);
    save("grid-turned");
    const double psnr = psnr_to(AnalyticVolume({same}, 0, {}, 0.005), input.views[0]);
    std::printf("a turned grid: %.1f dB\n", psnr);
    EXPECT_GT(psnr, 32);
}

// Metavoxel by metavoxel, each fills its halo by itself.
TEST_F(VolumeDrawTest, AGridIsTheSameMetavoxelByMetavoxel) {
    const auto full = [](float share) { return std::clamp((1 - share) * 8, 0.0f, 1.0f); };
    load({grid_of_ball(ball(3), 35, full)}, {.metavoxels = 6, .voxels = 16});
    const FrameInput input = look_from({0.4f, 0.5f, 2});
    draw(input);
    const std::vector<Pixel> lattice = pixels_;
    volumes_->quality.by_metavoxel = true;
    draw(input);
    double least = 1;
    for (size_t i = 0; i < lattice.size(); ++i) {
        ASSERT_NEAR(lattice[i].through, pixels_[i].through, 0.01f) << i;
        ASSERT_LT(glm::distance(lattice[i].light, pixels_[i].light), 0.01f) << i;
        least = std::min(least, double(pixels_[i].through));
    }
    EXPECT_LT(least, 0.2);
}

}  // namespace
}  // namespace lodestone
