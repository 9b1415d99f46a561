// How much of the light an effect lets through to a place: a lattice in whose z direction the light shines. The effect
// writes it as plain words (Recipe::light_grid), and what lights surfaces reads it as texels.
//
// Words 0 .. 11: three rows of the affine map from world space to the lattice, as float bits. 12 .. 14: places in x, y and
// z; x is 0 where nothing is written. From LODE_LIGHT_GRID_HEAD on: a word a place, x fastest: red, green and blue from
// the lowest bits on, 10 bits each, 1023 for all of the light.
#ifndef LODESTONE_LIGHT_GRID_GLSL
#define LODESTONE_LIGHT_GRID_GLSL

#include "shared/frame.glsl"
#include "shared/light_grid.h"

vec3 light_from_word(uint word) { return vec3(uvec3(word, word >> 10, word >> 20) & 1023u) / 1023.0; }

vec3 light_shining_through(vec3 world) {
    uint head[15];
    for (int k = 0; k < 15; ++k) head[k] = texelFetch(light_grid_texels, k).x;
    ivec3 places = ivec3(head[12], head[13], head[14]);
    vec3 p;
    for (int row = 0; row < 3; ++row) {
        p[row] = dot(vec4(world, 1.0), vec4(uintBitsToFloat(head[4 * row]), uintBitsToFloat(head[4 * row + 1]),
                                            uintBitsToFloat(head[4 * row + 2]), uintBitsToFloat(head[4 * row + 3])));
    }
    // Past the sides, and in front, nothing stands in the light; behind, all of it does.
    vec3 last = vec3(places - 1);
    bool beside = any(lessThan(p, vec3(0.0))) || any(greaterThan(p.xy, last.xy)) || places.x == 0;
    p = clamp(p, vec3(0.0), max(last, vec3(0.0)));
    ivec3 low = min(ivec3(p), max(places - 2, ivec3(0)));
    vec3 f = p - vec3(low);
    int row = places.x, slice = places.x * places.y, at = LODE_LIGHT_GRID_HEAD + low.x + row * low.y + slice * low.z;
    vec3 of_slice[2];
    for (int z = 0; z < 2; ++z) {
        vec3 t[4];
        for (int k = 0; k < 4; ++k)
            t[k] = light_from_word(texelFetch(light_grid_texels, at + z * slice + (k >> 1) * row + (k & 1)).x);
        of_slice[z] = mix(mix(t[0], t[1], f.x), mix(t[2], t[3], f.x), f.y);
    }
    return beside ? vec3(1.0) : mix(of_slice[0], of_slice[1], f.z);
}

#endif
