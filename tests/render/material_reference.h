// What materials look like on a flat square, computed by itself on the CPU in doubles: glTF 2.0 (Khronos, 2021),
// section 3.9 and appendix B.
#pragma once

#include <functional>
#include <glm/ext/vector_double3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "frame/materials.h"
#include "frame/picture.h"
#include "frame/view.h"
#include "render/renderer.h"

namespace lodestone {

// A square of side 2 in the plane z = `height` that looks towards +z, or away from it. Its texture coordinates are
// uv_low at the upper left and uv_high at the lower right, as seen from where it looks. Those of the second set
// likewise, but the first of them runs down, and the second across. Its tangent is as TriMesh has it; 0 for none.
struct LookedAtSquare {
    float height = 0;
    bool turned = false;
    glm::vec2 uv_low{0}, uv_high{1};
    glm::vec2 second_low{0}, second_high{1};
    uint32_t material = 0;
    glm::vec4 tangent{0};
};

// Linear radiance from a direction of unit length; empty for a sky and a ground of one colour each.
using Surroundings = std::function<glm::dvec3(const glm::dvec3&)>;

// The picture of one square after another as a camera sees them: opaque ones by depth, blended ones over them. Without
// a shadow. Textures are magnified. Linear colours become sRGB bytes as they are shown; alpha is 255 where something
// is. What a surface reflects of its surroundings is summed over many directions.
Picture reference_picture(const std::vector<LookedAtSquare>& squares, const MaterialSet& set, const Camera& camera,
                          uint32_t width, uint32_t height, const ShadingOptions& look, const Surroundings& around = {});

}  // namespace lodestone
