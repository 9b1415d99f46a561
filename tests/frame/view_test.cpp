#include "frame/view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "base/random.h"
#include "frame/camera_path.h"
#include "frame/screen_error.h"

namespace lodestone {
namespace {

glm::vec3 to_ndc(const View& view, const glm::vec3& p) {
    const glm::vec4 clip = view.world_to_clip() * glm::vec4(p, 1);
    return glm::vec3(clip) / clip.w;
}

Camera camera_at_z(float z) {
    Camera camera;
    camera.eye = {0, 0, z};
    camera.near_plane = 0.5f;
    camera.far_plane = 50;
    return camera;
}

TEST(View, DepthIsReversedFromOneAtTheNearPlaneToZeroAtTheFarPlane) {
    const View view = view_of(camera_at_z(10), 640, 360);
    EXPECT_NEAR(to_ndc(view, {0, 0, 9.5f}).z, 1, 1e-5);
    EXPECT_NEAR(to_ndc(view, {0, 0, -40}).z, 0, 1e-5);
    EXPECT_GT(to_ndc(view, {0, 0, 5}).z, to_ndc(view, {0, 0, 4}).z);
}

TEST(View, XPointsRightAndYUpOnScreen) {
    const View view = view_of(camera_at_z(10), 640, 360);
    EXPECT_GT(to_ndc(view, {1, 0, 0}).x, 0);
    EXPECT_LT(to_ndc(view, {0, 1, 0}).y, 0);  // Vulkan's y points down
}

TEST(View, FocalLengthGivesPixelsPerUnitAtDistanceOne) {
    const View view = view_of(camera_at_z(10), 640, 360);
    const float pixels = (to_ndc(view, {0, -1, 0}).y - to_ndc(view, {0, 0, 0}).y) * 180;
    EXPECT_NEAR(pixels, view.focal_px / 10, 1e-3);
}

TEST(View, ALookStraightDownStillHasAnUpright) {
    Camera camera;
    camera.eye = {0, 5, 0};
    camera.target = {0, 0, 0};
    const glm::vec3 p = to_ndc(view_of(camera, 64, 64), {0, 0, 0});
    EXPECT_NEAR(p.x, 0, 1e-5);
    EXPECT_TRUE(std::isfinite(p.z));
}

TEST(View, AShadowViewContainsItsSphere) {
    const View view = shadow_view({-1, -2, -0.5f}, {3, 4, 5}, 2, 1024);
    for (const glm::vec3& d :
         {glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, 1), glm::vec3(-1, 0, 0), glm::vec3(0, -1, 0)}) {
        const glm::vec3 p = to_ndc(view, glm::vec3(3, 4, 5) + 1.99f * d);
        EXPECT_LE(std::abs(p.x), 1);
        EXPECT_LE(std::abs(p.y), 1);
        EXPECT_GE(p.z, 0);
        EXPECT_LE(p.z, 1);
    }
    const glm::vec3 light = glm::normalize(glm::vec3(-1, -2, -0.5f));
    EXPECT_GT(to_ndc(view, glm::vec3(3, 4, 5) - light).z, to_ndc(view, glm::vec3(3, 4, 5) + light).z);
}

TEST(Frustum, TouchesWhatIsInsideAndNotWhatIsFarOutside) {
    const View view = view_of(camera_at_z(10), 640, 360);
    const Frustum frustum = frustum_of(view);
    EXPECT_TRUE(frustum.touches({0, 0, 0}, 1));
    EXPECT_FALSE(frustum.touches({0, 0, 20}, 1));    // behind
    EXPECT_FALSE(frustum.touches({0, 0, -100}, 1));  // past the far plane
    EXPECT_FALSE(frustum.touches({100, 0, 0}, 1));
    EXPECT_TRUE(frustum.touches({0, 0, 10.5f}, 1));  // around the eye
}

// A point of what a camera sees, near its sides as often as in its middle.
glm::vec3 point_seen(const View& view, Random& random) {
    const auto side = [&] { return static_cast<float>(2 * random.unit() - 1); };
    const glm::vec4 clip(side(), side(), std::exp2(-10 * static_cast<float>(random.unit())), 1);
    const glm::vec4 p = glm::inverse(view.world_to_clip()) * clip;
    return glm::vec3(p) / p.w;
}

TEST(Frustum, OfAShadowViewKeepsWhatCastsAShadowOnWhatIsSeenAndLittleElse) {
    Random random(1);
    const auto any = [&](float size) { return size * static_cast<float>(2 * random.unit() - 1); };
    size_t kept = 0, others = 0;
    for (int i = 0; i < 200; ++i) {
        Camera camera;
        camera.eye = {any(10), any(10), any(10)};
        camera.target = {any(10), any(10), any(10)};
        camera.near_plane = 0.1f;
        camera.far_plane = 30;
        const glm::vec3 light = glm::normalize(glm::vec3(any(1), any(1), any(1)));
        std::vector<View> views = {view_of(camera, 640, 360), shadow_view(light, {0, 0, 0}, 20, 2048)};
        views[1].shades_first_view_alone = true;
        const std::vector<Frustum> frusta = frusta_of(views);
        EXPECT_LE(frusta[1].planes().size(), Frustum::most_planes);
        const Frustum whole = frustum_of(views[1]);
        for (int k = 0; k < 200; ++k) {
            const glm::vec3 caster = point_seen(views[0], random) - light * static_cast<float>(40 * random.unit());
            EXPECT_EQ(frusta[1].touches(caster, 1e-3f), whole.touches(caster, 1e-3f)) << i;
        }
        // Away from what is seen by more than is looked up beside it, nothing is kept whose ray from the light meets it
        // nowhere.
        Frustum near = frusta[0];
        for (glm::vec4& plane : near.planes()) plane.w += 2 * shadow_reach(views[1]);
        for (int k = 0; k < 200; ++k) {
            const glm::vec3 p(any(12), any(12), any(12));
            bool meets = false;
            for (float way = 0; way < 60 && !meets; way += 0.02f) meets = near.touches(p + light * way, 0);
            if (meets) continue;
            ++others;
            kept += frusta[1].touches(p, 0) ? 1 : 0;
        }
    }
    EXPECT_GT(others, 10000u);
    EXPECT_LT(kept, others / 100);
    // Without, all of them are.
    std::vector<View> views = {view_of(camera_at_z(10), 64, 64), shadow_view({0, -1, 0}, {0, 0, 0}, 20, 2048)};
    EXPECT_EQ(frusta_of(views)[1].planes().size(), Frustum::view_planes);
    EXPECT_TRUE(frusta_of(views)[1].touches({0, 0, 15}, 0));
    views[1].shades_first_view_alone = true;
    EXPECT_FALSE(frusta_of(views)[1].touches({0, 0, 15}, 0)) << "behind the eye";
    EXPECT_TRUE(frusta_of(views)[1].touches({0, 15, 0}, 0)) << "above what is seen";
}

TEST(ScreenError, AnErrorAtTheLimitProjectsToThePixelError) {
    const View view = view_of(camera_at_z(10), 640, 360);
    const double error = error_under(view, {{0, 0, 0}, 2}, glm::mat4(1), 1.5);
    // The nearest point of the sphere is at distance 8.
    EXPECT_NEAR(error * view.focal_px / 8, 1.5, 1e-4);
}

TEST(ScreenError, ShrinksWithTheScaleOfTheInstance) {
    const View view = view_of(camera_at_z(100), 640, 360);
    const glm::mat4 large = glm::scale(glm::mat4(1), glm::vec3(1, 3, 1));
    EXPECT_NEAR(largest_scale(large), 3, 1e-3);
    EXPECT_NEAR(error_under(view, {{0, 0, 0}, 0}, large, 1) * 3, error_under(view, {{0, 0, 0}, 0}, glm::mat4(1), 1),
                1e-4);
}

TEST(ScreenError, StaysPositiveInsideTheSphere) {
    const View view = view_of(camera_at_z(1), 640, 360);
    EXPECT_GT(error_under(view, {{0, 0, 0}, 5}, glm::mat4(1), 1), 0);
}

TEST(LargestScale, BoundsEveryVectorUnderShear) {
    glm::mat4 shear(1);
    shear[1][0] = 2;
    const float s = largest_scale(shear);
    for (int i = 0; i < 360; ++i) {
        const float a = static_cast<float>(i) * 0.01745f;
        EXPECT_LE(glm::length(glm::mat3(shear) * glm::vec3(std::cos(a), std::sin(a), 0)), s * 1.0001f);
    }
}

TEST(CameraPath, PassesThroughItsKeysAndMovesSmoothly) {
    CameraPath path;
    path.keys = {{{0, 0, 5}, {}}, {{2, 0, 4}, {}}, {{3, 1, 2}, {}}};
    EXPECT_EQ(path.at(0).eye, glm::vec3(0, 0, 5));
    EXPECT_EQ(path.at(0.5).eye, glm::vec3(2, 0, 4));
    EXPECT_EQ(path.at(1).eye, glm::vec3(3, 1, 2));
    EXPECT_EQ(path.at(7).eye, glm::vec3(3, 1, 2));
    for (uint32_t i = 0; i + 1 < 100; ++i)
        EXPECT_LT(glm::distance(path.frame(i, 100).eye, path.frame(i + 1, 100).eye), 0.1f);
    path.keys.resize(1);
    EXPECT_EQ(path.at(0.7).eye, glm::vec3(0, 0, 5));
}

}  // namespace
}  // namespace lodestone
