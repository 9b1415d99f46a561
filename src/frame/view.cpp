#include "frame/view.h"

#define GLM_FORCE_DEPTH_ZERO_TO_ONE
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "base/check.h"

namespace lodestone {

namespace {

// A vector not parallel to `direction` to stand a view upright with.
glm::vec3 upright(const glm::vec3& direction, const glm::vec3& wanted) {
    if (glm::length(glm::cross(direction, wanted)) > 1e-4f * glm::length(wanted)) return wanted;
    return std::abs(direction.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 0, 1);
}

}  // namespace

glm::vec3 View::forward() const {
    return -glm::normalize(glm::vec3(world_to_view[0][2], world_to_view[1][2], world_to_view[2][2]));
}

float View::corner_cosine() const {
    if (!(focal_px > 0)) return 1;
    const float tangent = std::hypot(static_cast<float>(width), static_cast<float>(height)) / 2 / focal_px;
    return 1 / std::sqrt(1 + tangent * tangent);
}

View view_of(const Camera& camera, uint32_t width, uint32_t height) {
    LODE_CHECK(width > 0 && height > 0, width, height);
    LODE_CHECK(camera.near_plane > 0 && camera.far_plane > camera.near_plane, camera.near_plane, camera.far_plane);
    View view;
    glm::vec3 direction = camera.target - camera.eye;
    if (glm::length(direction) == 0) direction = {0, 0, -1};
    direction = glm::normalize(direction);
    view.world_to_view = glm::lookAt(camera.eye, camera.eye + direction, upright(direction, camera.up));
    const float f = 1 / std::tan(camera.fov_y / 2);
    const float n = camera.near_plane, r = camera.far_plane;
    const float aspect = static_cast<float>(width) / static_cast<float>(height);
    // Columns; depth = (n * r / -z - n) / (r - n) reversed: 1 at -z = n, 0 at -z = r.
    view.view_to_clip = glm::mat4(f / aspect, 0, 0, 0,    //
                                  0, -f, 0, 0,            //
                                  0, 0, n / (r - n), -1,  //
                                  0, 0, n * r / (r - n), 0);
    view.eye = camera.eye;
    view.near_plane = n;
    view.far_plane = r;
    view.focal_px = f * static_cast<float>(height) / 2;
    view.width = width;
    view.height = height;
    return view;
}

View shadow_view(const glm::vec3& direction, const glm::vec3& centre, float radius, uint32_t size) {
    LODE_CHECK(radius > 0 && size > 0, radius, size);
    const glm::vec3 along = glm::normalize(direction);
    View view;
    view.kind = View::Kind::shadow;
    view.eye = centre - along * radius;
    view.world_to_view = glm::lookAt(view.eye, centre, upright(along, {0, 1, 0}));
    view.near_plane = 0;
    view.far_plane = 2 * radius;
    const float s = 1 / radius;
    view.view_to_clip = glm::mat4(s, 0, 0, 0,      //
                                  0, -s, 0, 0,     //
                                  0, 0, s / 2, 0,  //
                                  0, 0, 1, 1);
    view.width = view.height = size;
    return view;
}

Frustum::Frustum(const std::array<glm::vec4, view_planes>& of_view) { std::ranges::copy(of_view, planes_.begin()); }

bool Frustum::touches(const glm::vec3& centre, float radius) const {
    return std::ranges::none_of(
        planes(), [&](const glm::vec4& plane) { return glm::dot(glm::vec3(plane), centre) + plane.w < -radius; });
}

void Frustum::keep_casters_into(const Frustum& lit, const glm::vec3& to_light) {
    // Towards the light nothing leaves a plane that faces it. Sums of one that does and one that does not, weighted so
    // that they stand along the light, are left by nothing either; together they bound what is swept (Farkas).
    const auto add = [&](const glm::vec4& plane) {
        const float length = glm::length(glm::vec3(plane));
        if (length > 1e-3f && count_ < most_planes) planes_[count_++] = plane / length;
    };
    const auto along = [&](const glm::vec4& plane) { return glm::dot(glm::vec3(plane), to_light); };
    for (const glm::vec4& facing : lit.planes().first(view_planes)) {
        if (along(facing) < 0) continue;
        add(facing);
        for (const glm::vec4& averted : lit.planes().first(view_planes)) {
            if (along(averted) < 0) add(facing * -along(averted) + averted * along(facing));
        }
    }
}

Frustum frustum_of(const View& view) {
    const glm::mat4 m = view.world_to_clip();
    const glm::vec4 x = glm::row(m, 0), y = glm::row(m, 1), z = glm::row(m, 2), w = glm::row(m, 3);
    Frustum frustum({w + x, w - x, w + y, w - y, z, w - z});
    for (glm::vec4& plane : frustum.planes()) {
        const float length = glm::length(glm::vec3(plane));
        if (length > 0) plane /= length;
    }
    return frustum;
}

float shadow_reach(const View& shadow) {
    // The filter, and what is lit is lifted off its surface: by less than eight texels.
    return 8 * 2 / (shadow.view_to_clip[0][0] * static_cast<float>(shadow.width));
}

void keep_casters(std::span<const View> views, std::span<Frustum> frusta) {
    for (size_t v = 1; v < views.size(); ++v) {
        if (!views[v].shades_first_view_alone) continue;
        Frustum lit = frusta[0];
        for (glm::vec4& plane : lit.planes()) plane.w += shadow_reach(views[v]);
        frusta[v].keep_casters_into(lit, -views[v].forward());
    }
}

std::vector<Frustum> frusta_of(std::span<const View> views) {
    std::vector<Frustum> frusta;
    for (const View& view : views) frusta.push_back(frustum_of(view));
    keep_casters(views, frusta);
    return frusta;
}

}  // namespace lodestone
