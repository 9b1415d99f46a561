#include "frame/free_camera.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

namespace lodestone {
namespace {

Camera camera() {
    Camera c;
    c.eye = {0, 0, 4};
    c.target = {0, 0, 1};
    return c;
}
#define EXPECT_PLACE(a, ...) EXPECT_LT(glm::distance(a, glm::vec3(__VA_ARGS__)), 1e-5f)

TEST(FreeCamera, TurnsAboutItsTargetAndStopsShortOfThePoles) {
    FreeCamera free(camera());
    free.orbit(1.5707963f, 0);
    EXPECT_PLACE(free.camera().eye, 3, 0, 1);
    free.orbit(0, 100);
    EXPECT_NEAR(glm::distance(free.camera().eye, free.camera().target), 3, 1e-5);
    EXPECT_GT(free.camera().eye.y, 2.99f);
    EXPECT_GT(free.camera().eye.x, 0);
    free.orbit(0, -100);
    EXPECT_LT(free.camera().eye.y, -2.99f);
    EXPECT_PLACE(free.camera().target, 0, 0, 1);
}

TEST(FreeCamera, LooksRoundFromWhereItStands) {
    FreeCamera free(camera());
    free.look(1.5707963f, 0);
    EXPECT_PLACE(free.camera().eye, 0, 0, 4);
    EXPECT_PLACE(free.camera().target, 3, 0, 4);
}

TEST(FreeCamera, FliesAlongItsGazeAndApproaches) {
    FreeCamera free(camera());
    free.move(1, 2, 3);
    EXPECT_PLACE(free.camera().eye, 2, 3, 3);
    EXPECT_PLACE(free.camera().target, 2, 3, 0);
    free.approach(0.5f);
    EXPECT_PLACE(free.camera().eye, 2, 3, 1.5f);
}

TEST(FreeCamera, SeesTheWholeSceneFromAnywhere) {
    FreeCamera free(camera());
    for (const float away : {0.0f, 0.5f, 1.0f, 3.0f, 1000.0f}) {
        Camera c = camera();
        c.eye = {0, 0, away};
        free = FreeCamera(c);
        free.fit_planes({0, 0, 0}, 1);
        EXPECT_GT(free.camera().near_plane, 0);
        EXPECT_LT(free.camera().near_plane, std::max(away - 1, 0.01f));
        EXPECT_GT(free.camera().far_plane, away + 1);
    }
}

}  // namespace
}  // namespace lodestone
