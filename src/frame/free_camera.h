// A camera that a hand moves: it turns about a point, or flies.
#pragma once

#include <glm/vec3.hpp>

#include "frame/view.h"

namespace lodestone {

// A camera with the moves of a viewer.
class FreeCamera {
public:
    FreeCamera() = default;
    // Begins where `start` is; its eye and target are not the same point.
    explicit FreeCamera(const Camera& start) : camera_(start) {}

    const Camera& camera() const { return camera_; }  // where it is now

    // Turns the eye about the target; radians, positive to the right and upwards. It stops short of the poles.
    void orbit(float right, float up);
    // Turns the gaze about the eye, likewise.
    void look(float right, float up);
    // Brings the eye `factor` times as far from the target, factor > 0.
    void approach(float factor);
    // Moves eye and target along the gaze, to its right and along `up`, world units.
    void move(float forward, float right, float up);

    // Near and far planes that suit a scene within a sphere, wherever the eye stands.
    void fit_planes(const glm::vec3& centre, float radius);

private:
    Camera camera_;
};

}  // namespace lodestone
