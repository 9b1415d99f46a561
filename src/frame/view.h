// A view: where from and how a scene is projected. One per camera, shadow map or half of a split screen.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

namespace lodestone {

// World and view space are right-handed; view space looks down -z with y up. Clip space is Vulkan's: x right, y down,
// depth reversed, 1 at the near plane and 0 at the far plane.
struct View {
    // What is made of the view.
    enum class Kind : uint8_t {
        camera,  // a picture
        shadow,  // depths from the light
    };
    Kind kind = Kind::camera;    // how its draws are staged
    glm::mat4 world_to_view{1};  // a rotation and a translation
    glm::mat4 view_to_clip{1};   // a projection
    glm::vec3 eye{0};            // world units; of a shadow view: somewhere on its near plane
    float near_plane = 0.1f;     // world units, > 0 for a camera
    float far_plane = 1000;      // world units, > near_plane
    float focal_px = 0;  // pixels spanned by a length of 1 at distance 1 in the centre; 0 for an orthographic view
    uint32_t width = 0, height = 0;  // pixels
    bool culls_back_faces = false;   // drawn without back faces: a backend may leave out what shows it nothing else
    // Of a shadow view: its depths are looked up for what the first view shows, and nothing else. A backend may leave
    // out what casts no shadow there.
    bool shades_first_view_alone = false;

    glm::mat4 world_to_clip() const { return view_to_clip * world_to_view; }  // both, one after the other
    glm::vec3 forward() const;                                                // unit vector, world space
    float corner_cosine() const;  // of the angle to the picture's corners; 1 for an orthographic view
    bool operator==(const View&) const = default;
};

// A perspective camera.
struct Camera {
    glm::vec3 eye{0, 0, 3};    // world units
    glm::vec3 target{0};       // what it looks at, in the middle of the picture; world units
    glm::vec3 up{0, 1, 0};     // of the picture, any length; another is taken where the camera looks along it
    float fov_y = 0.785f;      // radians from the bottom to the top of the picture, 0 < fov_y < pi
    float near_plane = 0.01f;  // world units, > 0
    float far_plane = 100;     // world units, > near_plane
};
// The view of a camera onto a picture of width x height pixels, both > 0.
View view_of(const Camera& camera, uint32_t width, uint32_t height);

// An orthographic view along `direction` (from the light towards the scene) that just contains the sphere.
View shadow_view(const glm::vec3& direction, const glm::vec3& centre, float radius, uint32_t size);

// A part of space between planes that point inwards: inside iff dot(plane.xyz, p) + plane.w >= 0 for all.
class Frustum {
public:
    static constexpr size_t view_planes = 6;   // of a view
    static constexpr size_t most_planes = 32;  // that there is room for

    // Of a view, in world space: left, right, top, bottom, far, near; unit normals.
    explicit Frustum(const std::array<glm::vec4, view_planes>& of_view);
    std::span<glm::vec4> planes() { return std::span(planes_).first(count_); }              // those of the view first
    std::span<const glm::vec4> planes() const { return std::span(planes_).first(count_); }  // the same
    // False only when the sphere is wholly outside; may be true for some spheres that are.
    bool touches(const glm::vec3& centre, float radius) const;
    // Leaves out what casts no shadow into another one that has the planes of a view: what is in this one stays that is
    // in the other or, seen from somewhere in it, towards the light. to_light: a unit vector.
    void keep_casters_into(const Frustum& lit, const glm::vec3& to_light);

private:
    std::array<glm::vec4, most_planes> planes_{};
    uint32_t count_ = view_planes;
};
Frustum frustum_of(const View& view);  // of the whole picture
// How far beside what is lit a shadow map is looked up (shaders/shared/lighting.glsl), at most. World units.
float shadow_reach(const View& shadow);
// Leaves out of the frusta of shadow views that shade the first alone what casts no shadow there. frusta: one per view,
// at least as wide as its own.
void keep_casters(std::span<const View> views, std::span<Frustum> frusta);
// Of each view; of shadow views that shade the first alone, of what casts a shadow there.
std::vector<Frustum> frusta_of(std::span<const View> views);

}  // namespace lodestone
