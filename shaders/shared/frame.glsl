// Descriptor set 0 as GLSL sees it.
#ifndef LODESTONE_FRAME_GLSL
#define LODESTONE_FRAME_GLSL

#include "shared/draw_constants.h"
#include "shared/frame_constants.h"
#include "shared/materials.h"

layout(set = 0, binding = LODE_FRAME_CONSTANTS, std140) uniform FrameBlock { FrameConstants frame; };
// Pipelines that show no debug view say so: software rasterisers run every branch of a shader.
layout(constant_id = LODE_DEBUG_CONSTANT) const bool shows_debug_views = true;
// False where no effect is drawn beside: then nothing stands in the light but triangles.
layout(constant_id = LODE_EFFECT_CONSTANT) const bool beside_effect = false;
// False where nothing but depths is drawn: vertices need no more than their places.
layout(constant_id = LODE_FRAGMENTS_CONSTANT) const bool has_fragments = true;
// What the materials of the scene ask for: LODE_LOOKS_ bits.
layout(constant_id = LODE_LOOKS_CONSTANT) const uint scene_looks = 0x1ffffu;
bool scene_has(uint looks) { return (scene_looks & looks) != 0u; }
// Of the triangle drawn, in triangle_marks.
#define LODE_MARK_OF_PRIMITIVE                                    \
    (draw_constants.first_mark == LODE_NO_MARKS ? LODE_NO_MARKS \
                                                : draw_constants.first_mark + uint(gl_PrimitiveID))
uint debug_view() { return shows_debug_views ? frame.debug_view : LODE_DEBUG_NONE; }
// Texels: see shared/texels.glsl. What is not asked of a record is not read.
layout(set = 0, binding = LODE_INSTANCES) uniform usamplerBuffer instance_texels;
layout(set = 0, binding = LODE_INSTANCE_IDS) uniform usamplerBuffer instance_id_texels;
layout(set = 0, binding = LODE_MATERIALS) uniform usamplerBuffer material_texels;
layout(set = 0, binding = LODE_SHADOW_DEPTH) uniform sampler2D shadow_depth;
// See shared/light_grid.glsl.
layout(set = 0, binding = LODE_LIGHT_GRID) uniform usamplerBuffer light_grid_texels;
// What the depth stage left, for the stages after it.
layout(set = 0, binding = LODE_SCENE_DEPTH) uniform sampler2D scene_depth;
layout(set = 0, binding = LODE_VISIBILITY) uniform usampler2D visibility;
layout(set = 0, binding = LODE_FURTHER_VISIBILITY) uniform usampler2D further_visibility;
// What the colour stage left, where an effect is drawn.
layout(set = 0, binding = LODE_RADIANCE) uniform sampler2D radiance;
// A byte a triangle, four to a word; from draw_constants.first_mark on they are the draw's own.
layout(set = 0, binding = LODE_TRIANGLE_MARKS, std430) readonly buffer MarkBlock { uint triangle_marks[]; };

// index: gl_InstanceIndex.
uint instance_id_at(int index) { return texelFetch(instance_id_texels, index).x; }
InstanceConstants instance_at(uint id) {
    uvec4 texels[9];
    for (int k = 0; k < 9; ++k) texels[k] = texelFetch(instance_texels, 9 * int(id) + k);
    mat4 maps[2];
    for (int k = 0; k < 8; ++k) maps[k / 4][k % 4] = uintBitsToFloat(texels[k]);
    return InstanceConstants(maps[0], maps[1], texels[8].x, texels[8].y, uintBitsToFloat(texels[8].z), texels[8].w);
}

#endif
