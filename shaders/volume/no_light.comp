#version 460
#extension GL_GOOGLE_include_directive : require
// All of the light shines through columns of metavoxels in which there is no brick any more; and the head of the light
// grid.
#include "shared/light_grid.h"
#include "shared/frame.glsl"
#include "shared/texels.glsl"
#include "shared/volume.h"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 1, binding = LODE_VOLUME_LIGHT, std430) buffer LightBlock { uint light[]; };
LODE_TEXELS(LODE_VOLUME_TABLE, table, uint)

void main() {
    uvec2 place = gl_GlobalInvocationID.xy;
    if (place == uvec2(0u)) {
        vec3 scale = vec3(1.0 / vec2(volume.light_places.w), 1.0 / float(volume.light_step));
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 4; ++column)
                light[4 * row + column] = floatBitsToUint(volume.world_to_lattice[column][row] * scale[row]);
        }
        for (int k = 0; k < 3; ++k) light[12 + k] = volume.light_places[k];
    }
    if (any(greaterThanEqual(place, volume.light_places.xy))) return;
    uvec2 metavoxel = place * volume.light_places.w / volume.metavoxels.w;
    bool empty = true;
    for (uint z = 0u; z < volume.metavoxels.z; ++z) {
        empty = empty && table_at(table_place(uvec3(metavoxel, z), volume.filled_half)) == LODE_NO_BRICK;
    }
    if (!empty) return;
    for (uint z = 0u; z < volume.light_places.z; ++z)
        light[LODE_LIGHT_GRID_HEAD + (z * volume.light_places.y + place.y) * volume.light_places.x + place.x] =
            0x3fffffffu;
}
