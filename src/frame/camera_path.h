// A camera flight: keyframes joined by a smooth curve, sampled at fixed steps so that every run sees the same pictures.
// Catmull and Rom, "A class of local interpolating splines", 1974 (uniform parameterisation).
#pragma once

#include <vector>

#include "frame/view.h"

namespace lodestone {

// Where the camera is at a keyframe.
struct CameraKey {
    glm::vec3 eye{0}, target{0};  // world units; it looks from one to the other
};

// The flight. A value; scene files hold one (docs/scenes.md).
struct CameraPath {
    std::vector<CameraKey> keys;                // at least one, evenly spaced in time
    glm::vec3 up{0, 1, 0};                      // world space, of every frame
    float fov_y = 0.785f;                       // radians
    float near_plane = 0.01f, far_plane = 100;  // world units
    uint32_t frames = 120;                      // of the whole flight

    // The camera at a time of the flight.
    // t: 0 (first key) .. 1 (last key); clamped.
    Camera at(double t) const;
    // Frame i of `count`: t = i / (count - 1).
    Camera frame(uint32_t i, uint32_t count) const;
};

}  // namespace lodestone
