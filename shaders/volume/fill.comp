#version 460
#extension GL_GOOGLE_include_directive : require
// Bricks of one layer of metavoxels, as the light meets them: density and colour of every voxel from the particles that may reach
// its block, and the light that reaches it. A thread is a column of voxels along the light. What has been taken out of
// the light on the way is handed from layer to layer in `front`.
//
//   "Sparse procedural volumetric rendering" (Intel, in GPU Pro 6): light propagated column by column, one sample of the
//   shadow map for each. Here visibility is the mean of four samples, so that it does not matter how fine the map is.
// Bricks that are marched one by one fill their halo themselves: a column of it is filled as the next brick fills its own,
// with what came through to that. So nothing but numbers is asked of neighbours, which need not be there.
// words: [0] the first brick; where bricks fill their halo, its place in the order. [1] 1: nothing was filled before this
// frame of what is being filled. [2] the place in the order that has the first slot.
#include "shared/frame.glsl"
#include "shared/light_grid.h"
#include "shared/texels.glsl"
#include "shared/volume.h"
#include "volume/voxel.glsl"
#include "volume/grid.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 0) const bool has_tables = false;
layout(constant_id = 1) const bool fills_halo = false;
layout(constant_id = 2) const bool has_grids = false;

LODE_TEXELS(LODE_VOLUME_TABLE, table, uint)
LODE_TEXELS(LODE_VOLUME_BRICKS, bricks, uvec4)
LODE_TEXELS(LODE_VOLUME_BLOCKS, blocks, uvec2)
LODE_TEXELS(LODE_VOLUME_LIST, list, uint)
LODE_TEXELS(LODE_VOLUME_PARTICLES, particles, uvec4)
LODE_TEXELS(LODE_VOLUME_LOOKS, looks, uvec4)
LODE_TEXELS(LODE_VOLUME_NOISE, noise, uint)
LODE_TEXELS(LODE_VOLUME_ORDER, order, uint)
LODE_STORED_POOL(LODE_VOLUME_VOXELS, voxels)
layout(set = 1, binding = LODE_VOLUME_FRONT, std430) buffer FrontBlock { float front[]; };
layout(set = 1, binding = LODE_VOLUME_LIGHT, std430) buffer LightBlock { uint light[]; };
layout(set = 1, binding = LODE_VOLUME_SCALES, std430) buffer ScaleBlock { float scales[]; };

// As in src/volume/noise_cube.h.
float noise_towards(vec3 d) {
    vec3 a = abs(d);
    int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    vec3 turned = axis == 0 ? d : axis == 1 ? d.yzx : d.zxy;
    vec2 place = clamp((turned.yz / max(abs(turned.x), 1e-20) * 0.5 + 0.5) * 64.0, 0.0, 64.0);
    vec2 low = min(floor(place), vec2(63.0)), f = place - low;
    uint face = 2u * uint(axis) + (turned.x < 0.0 ? 1u : 0u);
    vec4 v = unpackUnorm4x8(noise_at((face * 64u + uint(low.y)) * 64u + uint(low.x)));
    return mix(mix(v.x, v.y, f.x), mix(v.z, v.w, f.x), f.y);
}

// Of eight voxels, one after the other along the light. Sums over particles; colours are weighted by density.
float density[8];
vec3 scattered[8], sent_out[8];

void add_particle(uint number, vec3 first) {
    vec4 place = uintBitsToFloat(particles_at(3u * number)), turn = uintBitsToFloat(particles_at(3u * number + 1u));
    uvec4 more = particles_at(3u * number + 2u);
    float most_away = uintBitsToFloat(more.x), age = uintBitsToFloat(more.y), fade = uintBitsToFloat(more.z);
    vec4 from = uintBitsToFloat(looks_at(4u * more.w)), to = uintBitsToFloat(looks_at(4u * more.w + 1u));
    vec4 kind = uintBitsToFloat(looks_at(4u * more.w + 2u));  // scatter, emission, what colours go by
    uvec3 table = looks_at(4u * more.w + 3u).xyz;             // its first texel, its entries; 1 + number of its grid
    DensityGrid grid;
    if (has_grids && table.z > 0u) grid = grid_of(table.z - 1u);
    for (int k = 0; k < 8; ++k) {
        vec3 v = first + vec3(0.0, 0.0, float(k)) - place.xyz;
        float squared = dot(v, v);
        vec3 across = 2.0 * cross(turn.xyz, v);
        float pushed = noise_towards(v + turn.w * across + cross(turn.xyz, across));
        float radius = place.w * (1.0 - most_away * pushed);
        float share = sqrt(squared) / radius;
        float value = 1.0;
        if (has_grids && table.z > 0u) {
            float of_largest = grid_share(grid, first + vec3(0.0, 0.0, float(k)));
            share = 1.0 - of_largest;
            value = of_largest * grid.most;
        }
        float by = kind.z == 0.0 ? share : kind.z == 1.0 ? pushed : 1.0 - max(1.0 - share, 0.0) * (1.0 - age);
        vec4 look = vec4(mix(from.rgb, to.rgb, by), mix(from.w, to.w, share));
        if (has_tables) {
            float entry = clamp(share, 0.0, 1.0) * float(max(table.y, 1u) - 1u);
            uint low = uint(entry);
            vec4 a = uintBitsToFloat(looks_at(table.x + low));
            vec4 b = uintBitsToFloat(looks_at(table.x + min(low + 1u, max(table.y, 1u) - 1u)));
            vec4 found = mix(a, b, entry - float(low));
            if (table.y > 0u) look = vec4(found.rgb, look.w * found.w);
        }
        bool inside = squared < radius * radius || (has_grids && table.z > 0u);
        float d = inside ? max(look.w, 0.0) * value * fade : 0.0;
        density[k] += d;
        scattered[k] += d * kind.x * look.rgb;
        sent_out[k] += d * kind.y * look.rgb;
    }
}

// How far along the light, in voxels, the scene lets it come: of four places around the column.
vec4 shadow_begins(vec2 column) {
    const float far_away = 1e9;
    if (frame.shadow_view >= LODE_MOST_VIEWS) return vec4(far_away);
    vec4 begins;
    for (int k = 0; k < 4; ++k) {
        vec2 at = column + 0.5 * vec2(k & 1, k >> 1) - 0.25;
        mat4 to_clip = frame.views[frame.shadow_view].world_to_clip * volume.lattice_to_world;
        vec4 clip = to_clip * vec4(at, 0.0, 1.0);
        vec2 uv = clip.xy * 0.5 + 0.5;
        bool beside = any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0)));
        float depth = textureLod(shadow_depth, uv, 0.0).r;
        // Reversed: 0 where there is nothing.
        begins[k] = beside || depth <= 0.0 ? far_away : (depth - clip.z) / to_clip[2].z;
    }
    return begins;
}

void put_light(uvec3 place, vec3 shining) {
    uvec3 bits = uvec3(clamp(shining, 0.0, 1.0) * 1023.0 + 0.5);
    light[LODE_LIGHT_GRID_HEAD + (place.z * volume.light_places.y + place.y) * volume.light_places.x + place.x] =
        bits.r | bits.g << 10 | bits.b << 20;
}

// The places of the light grid from z = begin to before z = end, in voxels.
void put_lights(uvec2 column, uint begin, uint end, vec3 shining) {
    if (any(notEqual(column % volume.light_places.w, uvec2(0u)))) return;
    for (uint z = (begin + volume.light_step - 1u) / volume.light_step; z * volume.light_step < end; ++z)
        put_light(uvec3(column / volume.light_places.w, z), shining);
}

// A column of voxels to fill.
struct Column {
    uint slot;    // where it goes
    uvec2 local;  // and which of the slot's
    uint brick;   // whose voxels it has: the slot's, or in the halo the next one's; or LODE_NO_BRICK
    uvec2 owned;  // which of that brick's
    bool own;     // the brick is the slot's
};

Column column_of(uvec2 group, uvec2 in_group) {
    uint across = volume.metavoxels.w, columns = across + (fills_halo ? 1u : 0u), tiles = (columns + 7u) / 8u;
    uint number = draw_constants.words[0] + group.y;
    Column c;
    c.slot = number;
    c.brick = number;
    if (fills_halo) {
        c.slot = number - draw_constants.words[2];
        c.brick = order_at(number) & ~LODE_ORDERED_UNDER;
    }
    c.local = uvec2(group.x % tiles, group.x / tiles) * 8u + in_group;
    uvec2 next = uvec2(equal(c.local, uvec2(across)));
    c.owned = c.local * (1u - next);
    c.own = next == uvec2(0u);
    if (!c.own) {
        uint word = bricks_at(c.brick).x;
        uvec3 other = (uvec3(word, word >> 10, word >> 20) & 1023u) + uvec3(next, 0u);
        c.brick = LODE_NO_BRICK;
        if (all(lessThan(other, volume.metavoxels.xyz))) c.brick = table_at(table_place(other, volume.filled_half));
    }
    return c;
}

void put_voxel(Column c, uint z, uint word) {
    uint side = samples_across();
    voxels_put(((c.slot * side + z) * side + c.local.y) * side + c.local.x, word);
}

void main() {
    uint across = volume.metavoxels.w, tiles = (across + 7u) / 8u;
    Column c = column_of(gl_WorkGroupID.xy, gl_LocalInvocationID.xy);
    if (any(greaterThanEqual(c.local, uvec2(across + (fills_halo ? 1u : 0u))))) return;
    if (c.brick == LODE_NO_BRICK) {
        for (uint z = 0u; z <= across; ++z) put_voxel(c, z, 0u);
        return;
    }
    uvec4 brick = bricks_at(c.brick);
    uvec3 at = uvec3(brick.x, brick.x >> 10, brick.x >> 20) & 1023u, origin = at * across;
    uint gap_after = brick.y >> 16, tile = c.owned.y / 8u * tiles + c.owned.x / 8u;
    bool first = (brick.x >> 30 & 1u) != 0u, odd = brick.x >> 31 != 0u;
    uvec2 column = origin.xy + c.owned, columns = volume.metavoxels.xy * across;
    // From what the brick before has left to what this one leaves. They lie apart where a brick beside may read the
    // first after this one wrote the other.
    uint from = 3u * (column.y * columns.x + column.x), to = from;
    if (fills_halo) {
        from += odd ? 0u : 3u * columns.x * columns.y;
        to += odd ? 3u * columns.x * columns.y : 0u;
    }
    vec3 taken = first ? vec3(0.0) : vec3(front[from], front[from + 1u], front[from + 2u]);
    if (first && c.own) put_lights(column, 0u, origin.z, vec3(1.0));

    vec3 arriving = frame.light_colour.rgb / (4.0 * 3.14159265);  // scattered alike in all directions
    vec3 around = 0.5 * (frame.sky_colour.rgb + frame.ground_colour.rgb);
    vec3 largest = (1.0 - volume.forward) * arriving + around;
    float most = max(largest.r, max(largest.g, largest.b)) + volume.emission;
    // Once for all frames in which it is filled.
    uint scale_at = LODE_VOLUME_SCALE_RADIANCE + volume.filled_half;
    if (draw_constants.words[1] == 0u) most = scales[scale_at];
    else if (gl_WorkGroupID == uvec3(0u) && gl_LocalInvocationIndex == 0u) scales[scale_at] = most;
    vec4 begins = shadow_begins(vec2(column));

    vec3 before = vec3(0.0);  // what the voxel before takes out, per world unit
    for (uint block = 0u; block <= across / 8u; ++block) {
        uvec2 those = blocks_at((c.brick * tiles * tiles + tile) * (across / 8u + 1u) + block);
        for (int k = 0; k < 8; ++k) {
            density[k] = 0.0;
            scattered[k] = sent_out[k] = vec3(0.0);
        }
        vec3 place = vec3(column, origin.z + 8u * block);
        for (uint i = 0u; i < those.y; ++i) add_particle(list_at(those.x + i), place);
        for (uint k = 0u; k < 8u && 8u * block + k <= across; ++k) {
            uint z = 8u * block + k;
            vec3 takes = vec3(density[k]) - volume.forward * scattered[k];
            if (z > 0u)
                taken += volume.absorption == LODE_ABSORPTION_EXP ? 0.5 * volume.voxel * (before + takes)
                                                                  : log(1.0 + volume.voxel * before);
            before = takes;
            vec3 shining = exp(-taken);
            uvec3 whole = uvec3(column, origin.z + z);
            if (c.own && whole.z % volume.light_step == 0u && z < across)
                put_lights(column, whole.z, whole.z + 1u, shining);
            float seen = dot(clamp(begins - float(whole.z) + 0.5, 0.0, 1.0), vec4(0.25));
            vec3 radiance = scattered[k] * ((1.0 - volume.forward) * seen * arriving * shining + around) + sent_out[k];
            float d = density[k];
            vec3 share = radiance / (max(d, 1e-20) * most);
            put_voxel(c, z, voxel_word(d / volume.filled_most_density, share, whole));
        }
    }
    if (!c.own) return;
    for (int k = 0; k < 3; ++k) front[to + k] = taken[k];
    put_lights(column, origin.z + across, origin.z + (1u + gap_after) * across, exp(-taken));
}
