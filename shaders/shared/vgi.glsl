// What vertex and fragment shaders of virtual geometry images share: pools, tables, addresses.
#ifndef LODESTONE_VGI_GLSL
#define LODESTONE_VGI_GLSL

#include "shared/frame.glsl"
#include "shared/pool.glsl"
#include "shared/vgi_texels.h"

LODE_POOL(LODE_VGI_GEOMETRY, geometry, uvec2, 2)
LODE_POOL(LODE_VGI_ATTRIBUTES, attributes, uint, 1)
layout(set = 1, binding = LODE_VGI_SLOTS, std430) readonly buffer VgiSlotBlock { uvec2 slots[]; };
layout(set = 1, binding = LODE_VGI_TABLE, std430) readonly buffer VgiTableBlock { uint page_table[]; };
layout(set = 1, binding = LODE_VGI_ASSETS, std430) readonly buffer VgiAssetBlock { VgiAsset assets[]; };
layout(set = 1, binding = LODE_VGI_CHARTS, std430) readonly buffer VgiChartBlock { float sample_spacing[]; };
layout(set = 1, binding = LODE_VGI_PATCHES, std430) readonly buffer VgiPatchBlock { uint patch_words[]; };
layout(set = 1, binding = LODE_VGI_CODES, std430) readonly buffer VgiCodeBlock { float codes[]; };

// Object units that a pixel spans at a point of the world, on an instance of that scale.
float pixel_at(vec3 world, float scale) {
    ViewConstants view = frame.views[draw_constants.view];
    return max(view.pixel_angle * distance(world, view.eye.xyz) / scale, 1e-30);
}

#endif
