#include "frame/free_camera.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/check.h"

namespace lodestone {

namespace {

// v turned by `right` about `up` and then by `rise` towards it.
glm::vec3 turned(const glm::vec3& v, const glm::vec3& up, float right, float rise) {
    constexpr float steepest = 1.55f;  // radians
    const glm::vec3 axis = glm::normalize(up);
    const float length = glm::length(v), height = glm::dot(v, axis);
    glm::vec3 flat = v - axis * height;
    if (glm::length(flat) < 1e-6f * length) flat = std::abs(axis.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 0, 1);
    flat = glm::normalize(flat - axis * glm::dot(flat, axis));
    const glm::vec3 side = glm::cross(axis, flat);
    const glm::vec3 ahead = flat * std::cos(right) + side * std::sin(right);
    const float angle = std::clamp(std::asin(std::clamp(height / length, -1.0f, 1.0f)) + rise, -steepest, steepest);
    return length * (ahead * std::cos(angle) + axis * std::sin(angle));
}

}  // namespace

void FreeCamera::orbit(float right, float up) {
    camera_.eye = camera_.target + turned(camera_.eye - camera_.target, camera_.up, right, up);
}

void FreeCamera::look(float right, float up) {
    camera_.target = camera_.eye + turned(camera_.target - camera_.eye, camera_.up, -right, up);
}

void FreeCamera::approach(float factor) {
    LODE_CHECK(factor > 0, factor);
    camera_.eye = camera_.target + (camera_.eye - camera_.target) * factor;
}

void FreeCamera::move(float forward, float right, float up) {
    const glm::vec3 ahead = glm::normalize(camera_.target - camera_.eye);
    const glm::vec3 side = glm::normalize(glm::cross(ahead, camera_.up));
    const glm::vec3 by = ahead * forward + side * right + glm::normalize(camera_.up) * up;
    camera_.eye += by;
    camera_.target += by;
}

void FreeCamera::fit_planes(const glm::vec3& centre, float radius) {
    const float away = glm::distance(camera_.eye, centre);
    camera_.far_plane = std::max(away + radius * 1.01f, radius * 0.1f);
    camera_.near_plane = std::max((away - radius) * 0.5f, camera_.far_plane * 1e-4f);
}

}  // namespace lodestone
