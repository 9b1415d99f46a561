// What renderers take light from all around by, against sums over all directions.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/packing.hpp>
#include <numbers>

#include "base/threads.h"
#include "light/cube.h"
#include "light/prefilter.h"
#include "light/reflected_shares.h"
#include "light/sky.h"

namespace lodestone {
namespace {

float luminance(const glm::vec3& c) { return glm::dot(c, glm::vec3(0.2126f, 0.7152f, 0.0722f)); }

TEST(Cube, PlacesAndDirectionsAreEachOthersInverse) {
    for (uint32_t face = 0; face < cube_faces; ++face) {
        for (const glm::vec2 at : {glm::vec2(0, 0), glm::vec2(-0.9f, 0.3f), glm::vec2(0.2f, 0.99f)}) {
            const CubePlace place = cube_place(3.0f * cube_direction(face, at));
            EXPECT_EQ(place.face, face);
            EXPECT_NEAR(glm::distance(place.place, at), 0, 1e-6f);
        }
    }
}

// Nothing jumps from face to face, on no level.
TEST(Cube, IsSmoothAcrossEdges) {
    std::vector<glm::vec3> texels;
    for (uint32_t i = 0; i < cube_faces * 32 * 32; ++i)
        texels.push_back(glm::normalize(cube_direction(i / 1024, texel_place(i % 32, i / 32 % 32, 32))));
    const RadianceCube cube(32, std::move(texels));
    for (const float level : {0.0f, 1.5f, 3.0f}) {
        for (int k = 0; k < 200; ++k) {
            const float along = 0.0099f * static_cast<float>(k - 100);
            const glm::vec3 before = cube.looked_up({1, along, 0.999f}, level),
                            after = cube.looked_up({0.999f, along, 1}, level);
            EXPECT_LT(glm::distance(before, after), 0.02f * std::exp2(level)) << level << ", " << along;
        }
    }
}

TEST(ReflectedShares, AFullyWhiteSmoothMetalReflectsEverything) {
    const glm::vec4 share = reflected_shares(0.8f, 0);
    EXPECT_NEAR(share.x + share.y, 1, 0.01f);
    // Schlick's term straight on and from the side.
    EXPECT_NEAR(reflected_shares(1, 0).y, 0, 1e-3f);
    EXPECT_NEAR(reflected_shares(0.2f, 0).y, std::pow(0.8f, 5.0f), 0.02f);
}

// One colour all around is seen as that colour by whatever faces it.
TEST(Environment, OneColourStaysThatColour) {
    const glm::vec3 colour(0.25f, 0.5f, 2);
    const Environment made = make_environment([&](const glm::vec3&) { return colour; }, 1, 128);
    for (const auto& level : made.levels) {
        for (const uint64_t texel : level)
            ASSERT_LT(glm::distance(glm::vec3(glm::unpackHalf4x16(texel)), colour), 0.003f);
    }
    EXPECT_LT(glm::distance(glm::vec3(made.matte[0]), colour), 1e-4f);
    for (size_t k = 1; k < made.matte.size(); ++k) EXPECT_LT(glm::length(made.matte[k]), 1e-3f) << k;
}

TEST(Environment, IsTheSameForAnyNumberOfThreads) {
    const ClearSky sky(glm::normalize(glm::vec3(0.3f, 0.5f, 0.2f)), {});
    set_thread_count(1);
    const Environment one = make_environment(sky, 1, 128);
    set_thread_count(5);
    const Environment five = make_environment(sky, 1, 128);
    set_thread_count(0);
    EXPECT_EQ(one.levels, five.levels);
    EXPECT_EQ(one.shares, five.shares);
    EXPECT_EQ(one.matte, five.matte);
}

TEST(Sky, IsAsBrightAsAskedFor) {
    for (const float height : {-0.5f, 0.05f, 0.4f, 1.0f}) {
        const ClearSky sky(glm::normalize(glm::vec3(1 - std::abs(height), height, 0.01f)), {.brightness = 0.7f});
        double seen = 0;
        constexpr int steps = 300;
        for (int i = 0; i < steps * steps; ++i) {
            const float up = std::sqrt((static_cast<float>(i / steps) + 0.5f) / steps), aside = std::sqrt(1 - up * up);
            const float turn = 2 * std::numbers::pi_v<float> * (static_cast<float>(i % steps) + 0.3f) / steps;
            const glm::vec3 light = sky({aside * std::cos(turn), up, aside * std::sin(turn)});
            EXPECT_TRUE(std::isfinite(light.x + light.y + light.z));
            seen += static_cast<double>(luminance(light));
        }
        EXPECT_NEAR(seen / (steps * steps), 0.7, 0.01) << height;
    }
}

// As skies are: bluer overhead than at the horizon, and brightest about the sun.
TEST(Sky, IsBlueAboveAndBrightAboutTheSun) {
    const glm::vec3 to_sun = glm::normalize(glm::vec3(1, 0.7f, 0));
    const ClearSky sky(to_sun, {});
    const auto blue = [&](const glm::vec3& d) { return sky(d).z / luminance(sky(d)); };
    EXPECT_GT(blue({0, 1, 0}), 1.2f * blue(glm::normalize(glm::vec3(-1, 0.02f, 0))));
    EXPECT_GT(luminance(sky(to_sun)), 3 * luminance(sky({0, 1, 0})));
    EXPECT_EQ(sky({0, -1, 0}), SkyLook{}.ground);
}

}  // namespace
}  // namespace lodestone
