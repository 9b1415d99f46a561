#version 460
#extension GL_GOOGLE_include_directive : require
// The halo of bricks across the light: first samples of the next bricks, nothing where there is none. (Along the light
// bricks fill their own.) A work group is a row of z of a brick.
// words: [0] the first brick.
#include "shared/frame.glsl"
#include "shared/texels.glsl"
#include "shared/volume.h"

layout(local_size_x = 64) in;

LODE_TEXELS(LODE_VOLUME_TABLE, table, uint)
LODE_TEXELS(LODE_VOLUME_BRICKS, bricks, uvec4)
LODE_STORED_POOL(LODE_VOLUME_VOXELS, voxels)

void main() {
    uint across = volume.metavoxels.w, side = samples_across();
    uint slot = draw_constants.words[0] + gl_WorkGroupID.y, z = gl_WorkGroupID.x;
    uvec3 at = uvec3(bricks_at(slot).x, bricks_at(slot).x >> 10, bricks_at(slot).x >> 20) & 1023u;
    for (uint i = gl_LocalInvocationIndex; i < 2u * across + 1u; i += 64u) {
        // Down the last column, then along the last row.
        uvec2 here = i <= across ? uvec2(across, i) : uvec2(i - across - 1u, across);
        uvec2 next = uvec2(here.x == across ? 1u : 0u, here.y == across ? 1u : 0u);
        uvec3 other = at + uvec3(next, 0u);
        uint from = LODE_NO_BRICK;
        if (all(lessThan(other.xy, volume.metavoxels.xy)))
            from = table_at(table_place(other, volume.filled_half));
        uvec2 there = here * (1u - next);
        uint word = 0u;
        if (from != LODE_NO_BRICK) word = voxels_at(((from * side + z) * side + there.y) * side + there.x);
        voxels_put(((slot * side + z) * side + here.y) * side + here.x, word);
    }
}
