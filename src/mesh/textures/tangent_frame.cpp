#include "mesh/textures/tangent_frame.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace lodestone {

TangentFrame tangent_frame(const glm::dvec3& e, const glm::dvec3& f, const glm::dvec2& uv_e, const glm::dvec2& uv_f) {
    const double area = uv_e.x * uv_f.y - uv_e.y * uv_f.x;
    if (area == 0 || !std::isfinite(area)) return {};
    return {(e * uv_f.y - f * uv_e.y) / area, (f * uv_e.x - e * uv_f.x) / area};
}

TangentFrame tangent_frame(const glm::dvec4& tangent, const glm::dvec3& normal) {
    const glm::dvec3 across(tangent), up = glm::cross(normal, across);
    return {across, tangent.w < 0 ? up : -up};
}

std::optional<std::array<glm::dvec3, 2>> TangentFrame::upright(const glm::dvec3& normal) const {
    const glm::dvec3 tangent = across - normal * glm::dot(normal, across);
    const double length = glm::length(tangent);
    if (!(length > 0)) return std::nullopt;
    const glm::dvec3 unit = tangent / length, up = glm::cross(normal, unit);
    return std::array{unit, glm::dot(up, down) > 0 ? -up : up};
}

}  // namespace lodestone
