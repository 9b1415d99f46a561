#include "frame/camera_path.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace lodestone {

namespace {

glm::vec3 spline(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, float t) {
    return 0.5f * (2.0f * b + (c - a) * t + (2.0f * a - 5.0f * b + 4.0f * c - d) * (t * t) +
                   (3.0f * b - a - 3.0f * c + d) * (t * t * t));
}

}  // namespace

Camera CameraPath::at(double t) const {
    LODE_CHECK(!keys.empty());
    const double place = std::clamp(t, 0.0, 1.0) * static_cast<double>(keys.size() - 1);
    const auto last = static_cast<ptrdiff_t>(keys.size()) - 1;
    const auto segment = std::min(static_cast<ptrdiff_t>(place), std::max<ptrdiff_t>(last - 1, 0));
    const auto local = static_cast<float>(place - static_cast<double>(segment));
    const auto key = [&](ptrdiff_t i) -> const CameraKey& {
        return keys[static_cast<size_t>(std::clamp<ptrdiff_t>(i, 0, last))];
    };
    const CameraKey &a = key(segment - 1), &b = key(segment), &c = key(segment + 1), &d = key(segment + 2);
    Camera camera;
    camera.eye = spline(a.eye, b.eye, c.eye, d.eye, local);
    camera.target = spline(a.target, b.target, c.target, d.target, local);
    camera.up = up;
    camera.fov_y = fov_y;
    camera.near_plane = near_plane;
    camera.far_plane = far_plane;
    return camera;
}

Camera CameraPath::frame(uint32_t i, uint32_t count) const {
    return at(count > 1 ? static_cast<double>(i) / static_cast<double>(count - 1) : 0.0);
}

}  // namespace lodestone
