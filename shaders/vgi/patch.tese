#version 460
#extension GL_GOOGLE_include_directive : require
// Vertices of a node of a grid cut: what GridPatch::append_indices (vgi/study/grid_patch.h) makes of it.
#include "shared/vgi_vertex.glsl"

layout(quads, equal_spacing, cw) in;

layout(location = 0) in uint in_first[];
layout(location = 1) in uint in_instance[];

void main() {
    uint first = in_first[0], id = in_instance[0], shape = patch_words[first], corner = patch_words[first + 1u];
    uint level = shape & 15u, n = 1u << ((shape >> 4) & 3u);
    uvec2 at = uvec2(gl_TessCoord.xy * float(n) + 0.5), low = uvec2(corner & 0xffffu, corner >> 16);
    // On a border down to the next vertex that the coarser side has.
    uvec4 coarser = uvec4(shape >> 8, shape >> 10, shape >> 12, shape >> 14) & 3u;
    uvec2 to = at;
    if (at.y == 0u) to.x = at.x >> coarser[0] << coarser[0];
    if (at.y == n) to.x = at.x >> coarser[2] << coarser[2];
    if (at.x == 0u) to.y = at.y >> coarser[3] << coarser[3];
    if (at.x == n) to.y = at.y >> coarser[1] << coarser[1];
    at = low + (to << level);
    VgiAsset asset = asset_at(draw_constants.words[LODE_VGI_WORD_ASSET]);
    // From the page of the sample's own level, as everybody reads it: it moves alike for all.
    uint shift = uint(findMSB(asset.page_cells)), base = uint(findMSB(asset.cells)) - shift;
    uint lowest = min(level, base), own = uint(findLSB(at.x | at.y | asset.cells));
    uint page_level = clamp(own, lowest, base), down = page_level + shift;
    ivec2 p = ivec2((at >> page_level) - (low >> down << shift));
    pass_on(pull_sample(patch_words[first + 2u + page_level - lowest], p, true, instance_at(id)), id);
}
