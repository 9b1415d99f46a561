// What volumes' shaders know of a frame, declared once for C++ and GLSL. std430.
#ifndef LODESTONE_VOLUME_H
#define LODESTONE_VOLUME_H

// Bindings of set 1.
#define LODE_VOLUME_CONSTANTS 0
#define LODE_VOLUME_TABLE 1      // twice (what is seen, what is being filled) a word a metavoxel: its brick's number, the
                                 // slot unless bricks are marched one by one; or LODE_NO_BRICK
#define LODE_VOLUME_BRICKS 2     // four words a brick: metavoxel in x, y and z, 10 bits each, bit 30 where it is the first of
                                 // its column, bit 31 for the second, fourth and so on; gap before | gap after << 16; a bit
                                 // a block that is not empty, two words
#define LODE_VOLUME_BLOCKS 3     // two words a block: its first particle in the list, how many
#define LODE_VOLUME_LIST 4       // numbers of particles
#define LODE_VOLUME_PARTICLES 5  // three texels of four words each
#define LODE_VOLUME_LOOKS 6      // texels of four words: four a look, then tables
#define LODE_VOLUME_NOISE 7      // NoiseCube::words
#define LODE_VOLUME_VOXELS 8     // slot by slot (samples across)^3 words
#define LODE_VOLUME_FRONT 9      // three floats a column: what has been taken out of the light, as optical depth. Twice
                                 // where bricks are marched one by one: what the even, what the odd of a column leave
#define LODE_VOLUME_LIGHT 10     // shared/light_grid.glsl
#define LODE_VOLUME_SCALES 11    // LODE_VOLUME_SCALE_...
#define LODE_VOLUME_TAPS 12      // four words a pixel of the target
#define LODE_VOLUME_RESULT 13    // two words a pixel of the picture: half floats of light, and what shines through
#define LODE_VOLUME_MISFITS 14   // arguments of a dispatch, how many pixels, and their numbers
#define LODE_VOLUME_ORDER 15     // bricks one by one: their numbers, in the order in which they are marched
#define LODE_VOLUME_GRIDS 16     // density grids where they stand: LODE_GRID_TEXELS texels of four words each
#define LODE_VOLUME_GRID_INDEX 17  // of each grid a word a block of its box: the block's number, or LODE_NO_BRICK
#define LODE_VOLUME_GRID_VALUES 18 // of each block 8^3 values, two a word: 65535 times the share of the grid's largest

#define LODE_NO_BRICK 0xffffffffu
#define LODE_VOLUME_BLOCK 8u
#define LODE_ORDERED_UNDER 0x80000000u  // of the order: it is laid under what is there, else over it
#define LODE_VOLUME_SCALE_RADIANCE 0  // and the next, for either half of the table: the largest that a voxel can hold
#define LODE_MISFITS_HEAD 4           // words before the pixels' numbers
#define LODE_MISFITS_GROUP 64u        // pixels a work group marches

// Three rows of the map from lattice space to the grid's voxels; then blocks of its box in x, y and z, and the largest
// value, float bits; then where its index begins.
#define LODE_GRID_TEXELS 5

#define LODE_ABSORPTION_EXP 0u
#define LODE_ABSORPTION_RATIONAL 1u

#ifdef __cplusplus
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>
namespace lodestone {
namespace gpu {
using mat4 = glm::mat4;
using vec4 = glm::vec4;
using uvec4 = glm::uvec4;
using uint = uint32_t;
#endif

struct VolumeConstants {
    mat4 world_to_lattice, lattice_to_world;
    uvec4 metavoxels;     // in x, y, z; w: voxels across one
    uvec4 light_places;   // of the light grid in x, y, z; w: voxels from one to the next across the light
    uvec4 picture;        // width, height; of the target: width, height
    uvec4 marched;        // the picture's pixels in which there may be something: first in x and y, past the last
    float voxel;          // world units
    float step_length;    // of view depth, world units
    float far_plane;      // world units: where steps are counted from
    float near_plane;     // world units
    float most_density;   // that a voxel which is seen can hold, per world unit
    float emission;       // the largest of all looks
    float forward;        // share of scattered light that goes on as it went
    float filled_most_density;  // that a voxel which is being filled can hold
    uint divisor;         // pixels of the picture, a side, for one of the target
    uint absorption;      // LODE_ABSORPTION_...
    uint light_step;      // voxels from one place of the light grid to the next along the light
    uint skips;           // 1: what is empty is skipped
    uint shown_half;      // of the table: what is seen
    uint filled_half;     // and what is being filled
    uint padding0, padding1;
};

#ifdef __cplusplus
static_assert(sizeof(VolumeConstants) == 128 + 4 * 16 + 64);
}  // namespace gpu
}  // namespace lodestone
#else
layout(set = 1, binding = LODE_VOLUME_CONSTANTS, std430) readonly buffer VolumeBlock { VolumeConstants volume; };
uint samples_across() { return volume.metavoxels.w + 1u; }
const float no_limit = 3.4e38;                 // of a tap that the scene did not cut off
const uvec2 nothing = uvec2(0u, 0x3c000000u);  // of the result: no light, and all shines through
// volume.marched in pixels of the target.
uvec4 marched_taps() {
    uint d = volume.divisor;
    return uvec4(volume.marched.xy / d, (volume.marched.zw + d - 1u) / d);
}
// Where a metavoxel's word lies in a half of the table.
uint table_place(uvec3 at, uint of_half) {
    uvec3 n = volume.metavoxels.xyz;
    return ((of_half * n.z + at.z) * n.y + at.y) * n.x + at.x;
}
#endif

#endif
