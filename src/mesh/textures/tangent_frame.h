// The frame that a map of normals is in: that of a tangent of the mesh, or else of a triangle's texture coordinates,
// made upright to a normal, as MikkTSpace (Mikkelsen, 2008) has it where it is made anew. shaders/shared/materials.glsl
// does the same for a pixel.
#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <optional>

namespace lodestone {

// Ways along a surface, of any length; 0 where texture coordinates have no area.
struct TangentFrame {
    glm::dvec3 across{0}, down{0};  // in which texture coordinates grow

    // Unit vectors across and up, perpendicular to each other and to the unit normal; up is against `down`. Nothing
    // where there are none.
    std::optional<std::array<glm::dvec3, 2>> upright(const glm::dvec3& normal) const;
};

// Of a mean of tangents as TriMesh has them, whose w is not 0, and the unit normal there.
TangentFrame tangent_frame(const glm::dvec4& tangent, const glm::dvec3& normal);

// Of a triangle: two of its sides, and what texture coordinates change along them.
TangentFrame tangent_frame(const glm::dvec3& e, const glm::dvec3& f, const glm::dvec2& uv_e, const glm::dvec2& uv_f);

}  // namespace lodestone
