#include "vgi/visibility.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "frame/screen_error.h"

namespace lodestone::vgi {

Frustum widened_frustum(const View& view, const CutMargin& margin) {
    if (margin == CutMargin{}) return frustum_of(view);
    View wide = view;
    if (view.kind == View::Kind::camera) {
        wide.view_to_clip[0][0] /= 1 + margin.widening;
        wide.view_to_clip[1][1] /= 1 + margin.widening;
    }
    Frustum frustum = frustum_of(wide);
    for (glm::vec4& plane : frustum.planes) plane.w += margin.distance;
    // Near and far planes follow the scene.
    frustum.planes[4].w += 0.1f * view.far_plane;
    frustum.planes[5].w += 0.5f * view.near_plane;
    return frustum;
}

Visibility::Visibility(const CutRequest& request, const Atlas& about) : about_(about) {
    const glm::mat4 to_object = glm::inverse(request.object_to_world);
    const bool closed = std::ranges::none_of(about.sides, [](const GluedSide& s) { return s.chart == ~0u; });
    cones_ = request.cull_back_faces && closed && glm::determinant(glm::mat3(request.object_to_world)) > 0;
    eye_ = glm::vec3(to_object * glm::vec4(request.views[0].eye, 1));
    eye_margin_ = request.margin.distance * largest_scale(to_object);
    for (const View& view : request.views) {
        Frustum frustum = widened_frustum(view, request.margin);
        for (glm::vec4& plane : frustum.planes) {
            plane = plane * request.object_to_world;  // a row vector times the matrix: the plane pulled back
            const float length = glm::length(glm::vec3(plane));
            if (length > 0) plane /= length;
        }
        frusta_.push_back(frustum);
    }
}

uint32_t Visibility::seen(uint32_t mask, uint32_t number) const {
    const PageBounds& bounds = about_.bounds[number];
    for (uint32_t v = 0; v < frusta_.size(); ++v) {
        if ((mask >> v & 1) != 0 && !frusta_[v].touches(bounds.centre, bounds.radius)) mask &= ~(1u << v);
    }
    if ((mask & 1) != 0 && cones_ && bounds.cosine > 0 && turned_away(bounds)) mask &= ~1u;
    return mask;
}

// Every normal of the cone turns away from the eye, wherever in the sphere it stands.
bool Visibility::turned_away(const PageBounds& bounds) const {
    const glm::vec3 axis = glm::normalize(glm::vec3(bounds.axis[0], bounds.axis[1], bounds.axis[2]));
    const glm::vec3 v = bounds.centre - eye_;
    const float cosine = static_cast<float>(bounds.cosine) / 127, sine = std::sqrt(1 - cosine * cosine);
    const float along = glm::dot(axis, v), across = std::sqrt(std::max(0.0f, glm::dot(v, v) - along * along));
    return along * cosine - across * sine > bounds.radius + eye_margin_;
}

}  // namespace lodestone::vgi
