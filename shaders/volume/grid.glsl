// Density grids (src/volume/grids/density_grid.h) as shaders sample them.
#ifndef LODESTONE_VOLUME_GRID_GLSL
#define LODESTONE_VOLUME_GRID_GLSL

#include "shared/texels.glsl"
#include "shared/volume.h"

LODE_TEXELS(LODE_VOLUME_GRIDS, grids, uvec4)
LODE_TEXELS(LODE_VOLUME_GRID_INDEX, grid_index, uint)
LODE_TEXELS(LODE_VOLUME_GRID_VALUES, grid_values, uint)

struct DensityGrid {
    vec4 to_voxel[3];  // rows, from lattice space
    uvec3 blocks;      // of its box
    float most;        // the largest value
    uint first;        // of its index
};

DensityGrid grid_of(uint number) {
    uint at = LODE_GRID_TEXELS * number;
    uvec4 box = grids_at(at + 3u);
    DensityGrid g;
    for (uint k = 0u; k < 3u; ++k) g.to_voxel[k] = uintBitsToFloat(grids_at(at + k));
    g.blocks = box.xyz;
    g.most = uintBitsToFloat(box.w);
    g.first = grids_at(at + 4u).x;
    return g;
}

// Of one voxel, wherever it lies: share of the largest, 0 .. 1.
float grid_share_at(DensityGrid g, ivec3 voxel) {
    uvec3 v = uvec3(voxel), block = v / 8u;  // below 0 is far above
    if (any(greaterThanEqual(block, g.blocks))) return 0.0;
    uint number = grid_index_at(g.first + (block.z * g.blocks.y + block.y) * g.blocks.x + block.x);
    if (number == LODE_NO_BRICK) return 0.0;
    v &= 7u;
    uint word = grid_values_at((number << 8) | v.z << 5 | v.y << 2 | v.x >> 1);
    return float((v.x & 1u) == 1u ? word >> 16 : word & 0xffffu) / 65535.0;
}

// Trilinear, at a place of lattice space. Without loops: a software rasteriser counts their rounds (binning.h).
float grid_share(DensityGrid g, vec3 place) {
    vec4 p = vec4(place, 1.0);
    vec3 voxel = vec3(dot(g.to_voxel[0], p), dot(g.to_voxel[1], p), dot(g.to_voxel[2], p));
    if (any(lessThan(voxel, vec3(-1.0))) || any(greaterThan(voxel, vec3(8u * g.blocks)))) return 0.0;
    vec3 low = floor(voxel), f = voxel - low;
    ivec3 v = ivec3(low);
    vec4 at_x0 = vec4(grid_share_at(g, v), grid_share_at(g, v + ivec3(0, 1, 0)), grid_share_at(g, v + ivec3(0, 0, 1)),
                      grid_share_at(g, v + ivec3(0, 1, 1)));
    vec4 at_x1 = vec4(grid_share_at(g, v + ivec3(1, 0, 0)), grid_share_at(g, v + ivec3(1, 1, 0)),
                      grid_share_at(g, v + ivec3(1, 0, 1)), grid_share_at(g, v + ivec3(1, 1, 1)));
    vec4 along_x = mix(at_x0, at_x1, f.x);
    vec2 along_y = mix(along_x.xz, along_x.yw, f.y);
    return mix(along_y.x, along_y.y, f.z);
}

#endif
