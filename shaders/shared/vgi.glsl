// What vertex and fragment shaders of virtual geometry images share: pools, tables, addresses.
#ifndef LODESTONE_VGI_GLSL
#define LODESTONE_VGI_GLSL

#include "shared/frame.glsl"
#include "shared/texels.glsl"
#include "shared/vgi_assets.glsl"

LODE_POOL(LODE_VGI_GEOMETRY, geometry, uvec2, 2)
LODE_POOL(LODE_VGI_ATTRIBUTES, attributes, uint, 1)
LODE_POOL(LODE_VGI_LEAVES, leaf, uvec4, 4)
LODE_TEXELS(LODE_VGI_SLOTS, slot, uvec2)
LODE_TEXELS(LODE_VGI_TABLE, page, uint)
LODE_TEXELS(LODE_VGI_CHARTS, spacing, uint)
LODE_TEXELS(LODE_VGI_CODES, code, uint)
LODE_TEXELS(LODE_VGI_CORNERS, corner, uvec4)
layout(set = 1, binding = LODE_VGI_PATCHES, std430) readonly buffer VgiPatchBlock { uint patch_words[]; };

// LODE_VGI_KIND_..., of the vertices there may be of what is drawn or lit. Software rasterisers run every branch.
layout(constant_id = 0) const uint kinds = LODE_VGI_EVERY_KIND;
const bool leaves_alone = (kinds & ~LODE_VGI_KINDS_OF_LEAVES) == 0u;
layout(constant_id = LODE_VGI_OWN_UVS_CONSTANT) const uint leaves_have_uvs = 0u;

float decoded_at(uint code) { return uintBitsToFloat(code_at(code)); }

// Of a sample of positions; lattice units.
vec3 lattice(uvec2 texel) { return vec3(float(texel.x & 0xffffu), float(texel.x >> 16), float(texel.y & 0xffffu)); }

// Object units that a pixel spans at a point of the world, on an instance of that scale.
float pixel_at(vec3 world, float scale) {
    ViewConstants view = frame.views[draw_constants.view];
    return max(view.pixel_angle * distance(world, view.eye.xyz) / scale, 1e-30);
}

#endif
