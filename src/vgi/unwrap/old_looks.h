// How a mesh looked by its old texture coordinates, at places of its new square.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mesh/textures/tangent_frame.h"
#include "mesh/tri_mesh.h"
#include "vgi/unwrap/unwrap.h"

namespace lodestone::vgi {

// What is baked into an image of its own.
enum class Look : uint8_t {
    colour,    // linear base colour and alpha
    surface,   // occlusion, roughness, metal
    normals,   // a unit vector in the tangent frame of the new texture coordinates
    emission,  // linear, in shares of the brightest
};
inline constexpr size_t look_count = 4;

// An image under a triangle.
struct OldImage {
    const Image* image = nullptr;  // null for none
    std::array<Wrap, 2> wrap{Wrap::repeat, Wrap::repeat};
    glm::dvec2 at{0}, by_x{0}, by_y{0};  // texture coordinates at the triangle's first corner, and by texel from it
};

// A triangle of the unwrapped mesh. Offsets are in texels of the new square from its first corner.
class OldLooks {
public:
    // resolution: texels along a side of the square. brightest: of emission, > 0.
    OldLooks(const TriMesh& source, const Unwrapped& unwrapped, uint32_t triangle, uint32_t resolution, Look look,
             float brightest);

    const std::array<glm::dvec2, 3>& corners() const { return corners_; }  // in texels, rows from the top
    bool flat() const { return twice_area_ == 0; }                         // whether it has no area there
    double texels_per_texel() const;               // of the old images, the most along an axis; 0 where there are none
    glm::vec4 at(const glm::dvec2& offset) const;  // as the look says; w is alpha, 1 of all but colour

private:
    // at: the old texture coordinates of the corners, where the texture is looked up.
    void place(OldImage& image, const TriMesh& source, const Texture& texture,
               const std::array<glm::dvec2, 3>& at) const;
    void set_frames(const Unwrapped& unwrapped, uint32_t triangle, const std::array<glm::dvec2, 3>& at,
                    const std::array<glm::dvec4, 3>& tangents);
    glm::vec4 normal_at(const glm::dvec2& offset) const;

    std::array<glm::dvec2, 3> corners_;
    double twice_area_ = 0;
    Look look_;
    float brightest_;
    const Material* material_;            // of the source, or a white one
    std::array<OldImage, 2> images_;      // of the look; the second is occlusion's
    TangentFrame old_frame_, new_frame_;  // of normals, by texture coordinates
    glm::dvec3 normal_{0}, normal_by_x_{0}, normal_by_y_{0};
    glm::dvec4 tangent_{0}, tangent_by_x_{0}, tangent_by_y_{0};  // of the source; of the old frame where w is not 0
};

}  // namespace lodestone::vgi
