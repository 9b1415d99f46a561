// Surfaces lit from all around by an environment, against sums over its directions that the CPU computes by itself: of
// the BRDF as it is, not split into what is mirrored and shares of it.
#include <gtest/gtest.h>

#include <cstdio>
#include <glm/geometric.hpp>

#include "base/looks/srgb.h"
#include "light/prefilter.h"
#include "light/sky.h"
#include "render/squares_test.h"

namespace lodestone {
namespace {

using glm::dvec3;

// A bright sky over a dark ground, and lamps, wide and narrow.
dvec3 lamps(const dvec3& d) {
    const auto lamp = [&](const dvec3& towards, double narrow) {
        return std::exp(narrow * (glm::dot(d, glm::normalize(towards)) - 1));
    };
    const double up = 1 / (1 + std::exp(-6 * d.y));
    return glm::mix(dvec3(0.1, 0.08, 0.05), dvec3(0.3, 0.4, 0.6), up) + dvec3(0.9, 0.5, 0.2) * lamp({0.3, 0.2, 1}, 60) +
           dvec3(0.2, 0.8, 0.3) * lamp({-0.5, 0, 1}, 25) + dvec3(0.6, 0.6, 0.9) * lamp({0.1, 1, 0.2}, 8) +
           dvec3(1.5, 1.5, 1.2) * lamp({-1, -0.2, -0.5}, 12);
}

std::shared_ptr<const Environment> environment_of(const Surroundings& around) {
    return std::make_shared<const Environment>(
        make_environment([&](const glm::vec3& d) { return glm::vec3(around(d)); }, 1));
}

class EnvironmentTest : public SquaresTest {
protected:
    EnvironmentTest() : SquaresTest(80, 60) {
        static const auto of_lamps = environment_of(lamps);
        look_.light_colour = {0.3f, 0.3f, 0.25f};
        around_ = lamps;
        set_.environment = of_lamps;
    }
    double nearness(float metallic, float roughness) {
        first().metallic = metallic;
        first().roughness = roughness;
        const double psnr = against_reference({{}});
        std::printf("metal %.2f, roughness %.2f: %.1f dB\n", static_cast<double>(metallic),
                    static_cast<double>(roughness), psnr);
        return psnr;
    }
};

TEST_F(EnvironmentTest, MetalAndRoughness) {
    for (const float metallic : {0.0f, 1.0f}) {
        for (const float roughness : {0.1f, 0.5f, 1.0f}) EXPECT_GT(nearness(metallic, roughness), 48);
    }
}

// Lobes are longer then than those that were summed up before.
TEST_F(EnvironmentTest, SeenFromTheSide) {
    camera_.eye = {0.2f, 2.4f, 1.0f};
    for (const float roughness : {0.25f, 0.5f, 1.0f}) EXPECT_GT(nearness(1, roughness), 41);
}

TEST_F(EnvironmentTest, MapsOfNormals) {
    add_texture(first().normal_texture, normals_of(10, 10, 2));
    first().normal_scale = 0.7f;
    EXPECT_GT(nearness(0.8f, 0.45f), 45);
}

TEST_F(EnvironmentTest, OcclusionTakesLightFromAllAroundAlone) {
    add_texture(first().occlusion_texture, image_of(16, 16, 3));
    first().occlusion_strength = 0.8f;
    EXPECT_GT(nearness(0, 0.45f), 55);
}

// It jumps at the horizon, and the sun's surroundings are thrice as bright as the rest.
TEST_F(EnvironmentTest, Sky) {
    const ClearSky sky(glm::normalize(-look_.light_direction), {});
    around_ = [&](const dvec3& d) { return dvec3(sky(d)); };
    set_.environment = environment_of(around_);
    for (const float roughness : {0.1f, 0.3f, 0.6f}) EXPECT_GT(nearness(0.9f, roughness), 42);
}

TEST_F(EnvironmentTest, IsSeenWhereNothingElseIs) {
    const Picture picture = drawn({{}}),
                  reference = reference_picture({}, set_, camera_, width_, height_, look_, around_);
    std::vector<uint8_t> bare;
    for (size_t i = 3; i < picture.colour.size(); i += 4) bare.push_back(picture.colour[i] == 0 ? 1 : 0);
    EXPECT_GT(std::ranges::count(bare, 1), 500);
    EXPECT_GT(psnr_db(picture, reference, bare), 50);
}

// As plain materials have it: matte.
TEST_F(EnvironmentTest, LightsPlainMaterials) {
    first().shading = Shading::plain;
    first().base_colour = {0.9f, 0.8f, 0.7f, 1};
    look_.light_colour = {0, 0, 0};
    const Picture picture = drawn({{}});
    dvec3 seen(0);
    constexpr int steps = 400;
    for (int i = 0; i < steps * steps; ++i) {
        const double up = std::sqrt((i / steps + 0.5) / steps), turn = 2 * std::acos(-1.0) * (i % steps + 0.5) / steps;
        seen += lamps({std::sqrt(1 - up * up) * std::cos(turn), std::sqrt(1 - up * up) * std::sin(turn), up});
    }
    const size_t centre = 4 * (size_t{height_ / 2} * width_ + width_ / 2);
    for (int k = 0; k < 3; ++k) {
        const double linear = static_cast<double>(first().base_colour[k]) * seen[k] / (steps * steps);
        EXPECT_NEAR(picture.colour[centre + static_cast<size_t>(k)], 255 * srgb_from_linear(linear), 2) << k;
    }
}

TEST_F(EnvironmentTest, CanBeTurnedOffAndLeavesDebugViewsAlone) {
    const auto loaded = set_.environment;
    for (const bool debug : {false, true}) {
        look_.debug = debug ? DebugView::triangle : DebugView::none;
        look_.environment = debug;
        set_.environment = loaded;
        const Picture with = drawn({{}});
        set_.environment = nullptr;
        EXPECT_EQ(with.colour, drawn({{}}).colour) << debug;
    }
}

}  // namespace
}  // namespace lodestone
