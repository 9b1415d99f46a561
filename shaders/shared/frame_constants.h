// What every shader of a frame can see (descriptor set 0), declared once for C++ and GLSL. std140 / std430.
#ifndef LODESTONE_FRAME_CONSTANTS_H
#define LODESTONE_FRAME_CONSTANTS_H

#define LODE_MOST_VIEWS 8

// Bindings of set 0.
#define LODE_FRAME_CONSTANTS 0
#define LODE_INSTANCES 1
#define LODE_INSTANCE_IDS 2
#define LODE_MATERIALS 3
#define LODE_TEXTURES 4
#define LODE_SHADOW_DEPTH 5
#define LODE_LIGHT_GRID 6
#define LODE_TRIANGLE_MARKS 7
#define LODE_SCENE_DEPTH 8
#define LODE_VISIBILITY 9
#define LODE_RADIANCE 10
#define LODE_ENVIRONMENT 11
#define LODE_REFLECTED_SHARES 12
#define LODE_FURTHER_VISIBILITY 13

// Beside a material's number, between stages: the instance is mirrored.
#define LODE_MIRRORED 0x80000000u

// visibility, third word: an instance, or this where there is none.
#define LODE_NOTHING_VISIBLE 0xffffffffu

// Specialisation constants of every pipeline: false where no effect is drawn beside; where there is no fragment shader;
// where no debug view is shown.
#define LODE_EFFECT_CONSTANT 13
#define LODE_FRAGMENTS_CONSTANT 14
#define LODE_DEBUG_CONSTANT 15

// FrameConstants::debug_view.
#define LODE_DEBUG_NONE 0
#define LODE_DEBUG_LEVEL 1
#define LODE_DEBUG_TRIANGLE 2
#define LODE_DEBUG_NORMAL 3
#define LODE_DEBUG_UV 4
#define LODE_DEBUG_MATERIAL 5
#define LODE_DEBUG_CHART 6
#define LODE_DEBUG_PAGE 7
#define LODE_DEBUG_MISSING 8
#define LODE_DEBUG_ERROR 9
#define LODE_DEBUG_STRETCH 10
#define LODE_DEBUG_MISSES 11
// Of volumes; surfaces are lit as ever.
#define LODE_DEBUG_VOLUME_BRICKS 12
#define LODE_DEBUG_VOLUME_OCCUPANCY 13
#define LODE_DEBUG_VOLUME_LIGHT 14
#define LODE_DEBUG_VOLUME_STEPS 15
#define LODE_DEBUG_LEAF 16  // of vgi
// Of materials.
#define LODE_DEBUG_BASE_COLOUR 17
#define LODE_DEBUG_ALPHA 18
#define LODE_DEBUG_METALLIC 19
#define LODE_DEBUG_ROUGHNESS 20
#define LODE_DEBUG_OCCLUSION 21
#define LODE_DEBUG_EMISSION 22

#ifdef __cplusplus
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>
namespace lodestone {
namespace gpu {
using mat4 = glm::mat4;
using vec4 = glm::vec4;
using uint = uint32_t;
#endif

struct ViewConstants {
    mat4 world_to_clip;
    mat4 clip_to_world;
    vec4 eye;           // world space; w: 1 for a camera, 0 for a shadow view
    vec4 forward;       // unit vector, world space; w: cosine of the angle to the picture's corners
    float pixel_angle;  // length that a pixel spans in the centre at distance 1; 0 where all are as far away
    float target_width, target_height;  // pixels that it is drawn to
    float padding;
};

struct FrameConstants {
    ViewConstants views[LODE_MOST_VIEWS];
    vec4 to_light;       // unit vector, world space
    vec4 light_colour;   // linear
    vec4 sky_colour;     // linear, from above
    vec4 ground_colour;  // linear, from below
    uint shadow_view;    // into views, LODE_MOST_VIEWS where there is none
    uint debug_view;
    uint double_sided;   // 1: normals turn towards the eye
    float shadow_texel;  // world units a texel of the shadow map spans
    uint shows_backs;    // 1: of materials with one side, too
    float environment_levels;  // of the cube of what is around, 0 where it lights nothing (frame/environment.glsl)
    uint padding0, padding1;
    vec4 environment_matte[9];
};

struct InstanceConstants {
    mat4 object_to_world;
    mat4 normal_to_world;  // its upper 3x3: inverse transpose
    uint first_material;
    uint asset;
    float scale;    // the most that a length grows by
    uint mirrored;  // 1: what is counter-clockwise is seen clockwise
};

#ifdef __cplusplus
static_assert(sizeof(ViewConstants) == 176);
static_assert(sizeof(FrameConstants) == 176 * LODE_MOST_VIEWS + 96 + 144);
static_assert(sizeof(InstanceConstants) == 144);
}  // namespace gpu
}  // namespace lodestone
#endif

#endif
