// Descriptor set 0 as GLSL sees it.
#ifndef LODESTONE_FRAME_GLSL
#define LODESTONE_FRAME_GLSL

#include "shared/draw_constants.h"
#include "shared/frame_constants.h"

layout(set = 0, binding = LODE_FRAME_CONSTANTS, std140) uniform FrameBlock { FrameConstants frame; };
// Pipelines that show no debug view say so: software rasterisers run every branch of a shader.
layout(constant_id = LODE_DEBUG_CONSTANT) const bool shows_debug_views = true;
// False where nothing but depths is drawn: vertices need no more than their places.
layout(constant_id = LODE_FRAGMENTS_CONSTANT) const bool has_fragments = true;
// Of the triangle drawn, in triangle_marks.
#define LODE_MARK_OF_PRIMITIVE                                    \
    (draw_constants.first_mark == LODE_NO_MARKS ? LODE_NO_MARKS \
                                                : draw_constants.first_mark + uint(gl_PrimitiveID))
uint debug_view() { return shows_debug_views ? frame.debug_view : LODE_DEBUG_NONE; }
layout(set = 0, binding = LODE_INSTANCES, std430) readonly buffer InstanceBlock { InstanceConstants instances[]; };
layout(set = 0, binding = LODE_INSTANCE_IDS, std430) readonly buffer InstanceIdBlock { uint instance_ids[]; };
layout(set = 0, binding = LODE_MATERIALS, std430) readonly buffer MaterialBlock { MaterialConstants materials[]; };
layout(set = 0, binding = LODE_TEXTURES) uniform sampler2DArray textures;
layout(set = 0, binding = LODE_SHADOW_DEPTH) uniform sampler2D shadow_depth;
layout(set = 0, binding = LODE_SHADOW_TRANSMITTANCE) uniform sampler2D shadow_transmittance;
// What the depth stage left, for the stages after it.
layout(set = 0, binding = LODE_SCENE_DEPTH) uniform sampler2D scene_depth;
layout(set = 0, binding = LODE_VISIBILITY) uniform usampler2D visibility;
// A byte a triangle, four to a word; from draw_constants.first_mark on they are the draw's own.
layout(set = 0, binding = LODE_TRIANGLE_MARKS, std430) readonly buffer MarkBlock { uint triangle_marks[]; };

#endif
