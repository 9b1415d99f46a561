#version 460
#extension GL_GOOGLE_include_directive : require
// Vertices of a node of a grid cut: what GridPatch::append_indices (vgi/grid_patch.h) makes of it.
#include "shared/vgi_sample.glsl"

layout(quads, equal_spacing, cw) in;

layout(location = 0) in uint in_first[];
layout(location = 1) in uint in_instance[];

layout(location = 0) out vec3 out_position;
layout(location = 1) out vec2 out_place;  // as in PulledSample
layout(location = 2) flat out uint out_chart;
layout(location = 3) flat out uint out_level;   // of the page the last corner is from
layout(location = 4) flat out uint out_first_material;
layout(location = 5) out float out_lod;
layout(location = 6) flat out mat3 out_normal_to_world;
layout(location = 9) out vec2 out_measures;  // as PulledSample's

// The depth pre-pass and the colour pass must agree to the last bit, and so must nodes along their borders.
invariant gl_Position;

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
    VgiAsset asset = assets[draw_constants.words[LODE_VGI_WORD_ASSET]];
    // From the page of the sample's own level, as everybody reads it: it moves alike for all.
    uint shift = uint(findMSB(asset.page_cells)), base = uint(findMSB(asset.cells)) - shift;
    uint lowest = min(level, base), own = uint(findLSB(at.x | at.y | asset.cells));
    uint page_level = clamp(own, lowest, base), down = page_level + shift;
    ivec2 p = ivec2((at >> page_level) - (low >> down << shift));
    PulledSample s = pull_sample(patch_words[first + 2u + page_level - lowest], p, instances[id].object_to_world);
    gl_Position = frame.views[draw_constants.view].world_to_clip * s.world;
    out_position = s.world.xyz;
    out_place = s.place;
    out_chart = s.chart;
    out_level = s.level;
    out_first_material = instances[id].first_material;
    out_lod = s.lod;
    out_measures = s.measures;
    out_normal_to_world = mat3(instances[id].normal_to_world);
}
