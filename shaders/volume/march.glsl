// Light and shadow of the volumes along a ray, front to back. Samples lie in the middle of steps of equal view depth,
// counted from the far plane for every ray alike: so pictures do not depend on how a volume is divided, and where a ray
// enters a metavoxel does not show. Each step counts with the length that the ray has in it.
//
//   Max, "Optical models for direct volume rendering", TVCG 1995, for emission and absorption.
#ifndef LODESTONE_VOLUME_MARCH_GLSL
#define LODESTONE_VOLUME_MARCH_GLSL

#include "shared/frame.glsl"
#include "shared/texels.glsl"
#include "shared/volume.h"
#include "volume/voxel.glsl"

LODE_TEXELS(LODE_VOLUME_TABLE, table, uint)
LODE_TEXELS(LODE_VOLUME_BRICKS, bricks, uvec4)
LODE_POOL(LODE_VOLUME_VOXELS, voxels, uint, 1u)
LODE_TEXELS(LODE_VOLUME_SCALES, scales, uint)

const float nothing_left = 1.0 / 512.0;  // of what shines through: what is behind it is not looked at

struct Marched {
    vec3 light;        // that comes towards the eye
    float through;     // of what is behind: the share that shines through
    float last;        // view depth up to which there is something
    bool cut;          // the scene ended it, and there may be more behind
    uint steps, jumps; // samples taken; times that something empty was skipped
};

struct ViewRay {
    vec3 origin, along;  // lattice space; a step of `along` is 1 of view depth
    float stretch;       // world units of the ray for 1 of view depth
    float scene;         // view depth of the scene
};

// Of the middle of a pixel of the picture.
ViewRay ray_of(ivec2 pixel) {
    ViewConstants view = frame.views[draw_constants.view];
    vec2 clip = (vec2(pixel) + 0.5) / vec2(volume.picture.xy) * 2.0 - 1.0;
    vec4 world = view.clip_to_world * vec4(clip, 0.5, 1.0);
    vec3 away = world.xyz / world.w - view.eye.xyz;
    away /= dot(away, view.forward.xyz);
    // Reversed: 0 where there is nothing, 1 on the near plane.
    float depth = texelFetch(scene_depth, pixel, 0).r;
    float n = volume.near_plane, r = volume.far_plane;
    ViewRay ray;
    ray.origin = (volume.world_to_lattice * vec4(view.eye.xyz, 1.0)).xyz;
    ray.along = mat3(volume.world_to_lattice) * away;
    ray.stretch = length(away);
    ray.scene = n * r / (depth * (r - n) + n);
    return ray;
}

// Adds a place's density and radiance: density, and radiance times it, both as sums of codes.
void add_corner(uint index, float weight, inout float density, inout vec3 radiance) {
    uint word = voxels_at(index);
    float code = density_code(word);
    float share = weight * code * code;
    density += share;
    radiance += share * radiance_codes(word);
}

// What is seen at a place of a brick: density, times the square of the largest code, and radiance.
struct Sampled {
    float density;
    vec3 radiance;
};

// slot: of the brick that the place is in. local: from the brick's corner, in voxels.
Sampled sample_of(uint slot, vec3 local) {
    float density = 0.0;
    vec3 codes = vec3(0.0);
    uint side = samples_across();
    uvec3 low = min(uvec3(local), uvec3(volume.metavoxels.w - 1u));
    vec3 f = local - vec3(low), g = 1.0 - f;
    uint index = ((slot * side + low.z) * side + low.y) * side + low.x;
    add_corner(index, g.x * g.y * g.z, density, codes);
    add_corner(index + 1u, f.x * g.y * g.z, density, codes);
    add_corner(index + side, g.x * f.y * g.z, density, codes);
    add_corner(index + side + 1u, f.x * f.y * g.z, density, codes);
    index += side * side;
    add_corner(index, g.x * g.y * f.z, density, codes);
    add_corner(index + 1u, f.x * g.y * f.z, density, codes);
    add_corner(index + side, g.x * f.y * f.z, density, codes);
    add_corner(index + side + 1u, f.x * f.y * f.z, density, codes);
    codes /= max(density, 1e-20) * 127.0;
    float scale = uintBitsToFloat(scales_at(LODE_VOLUME_SCALE_RADIANCE + volume.shown_half));
    return Sampled(density, scale * codes * codes);
}

// What shines through so much of a ray, from view depth to view depth, all of it as dense as the sample.
float shining_through(Sampled s, ViewRay ray, float from, float to) {
    float depth = s.density * (volume.most_density / (2047.0 * 2047.0)) * (to - from) * ray.stretch;
    return volume.absorption == LODE_ABSORPTION_EXP ? exp(-depth) : 1.0 / (1.0 + depth);
}

// The part of a ray that goes through the lattice and before the scene.
struct Part {
    vec3 along, inverse, size;       // of the ray, without zeros; of the lattice, voxels
    float enters, leaves, box_end;   // view depths; box_end: as leaves, if there were no scene
    int first, last;                 // steps, the nearest and the farthest. Step k ends at far_plane - k * step_length
};

Part part_of(ViewRay ray) {
    Part p;
    p.size = vec3(volume.metavoxels.xyz) * float(volume.metavoxels.w);
    p.along = mix(ray.along, vec3(1e-12), lessThan(abs(ray.along), vec3(1e-12)));
    p.inverse = 1.0 / p.along;
    vec3 a = -ray.origin * p.inverse, b = (p.size - ray.origin) * p.inverse;
    vec3 near3 = min(a, b), far3 = max(a, b);
    p.enters = max(max(near3.x, near3.y), max(near3.z, volume.near_plane));
    p.box_end = min(far3.x, min(far3.y, far3.z));
    p.leaves = min(p.box_end, ray.scene);
    p.first = int(ceil((volume.far_plane - p.enters) / volume.step_length)) - 1;
    p.last = int(floor((volume.far_plane - p.leaves) / volume.step_length));
    return p;
}

// Where a step begins and ends, in the part.
vec2 step_of(Part p, int k) {
    return vec2(max(volume.far_plane - float(k + 1) * volume.step_length, p.enters),
                min(volume.far_plane - float(k) * volume.step_length, p.leaves));
}

// The place that stands for a step, lattice space, in the lattice.
vec3 place_of(Part p, ViewRay ray, vec2 of_step) {
    return clamp(ray.origin + p.along * (0.5 * (of_step.x + of_step.y)), vec3(0.0), p.size - 0.001);
}

Marched march(ViewRay ray) {
    Marched m = Marched(vec3(0.0), 1.0, 0.0, false, 0u, 0u);
    float across = float(volume.metavoxels.w);
    Part p = part_of(ray);
    m.cut = p.enters < p.box_end && ray.scene < p.box_end;
    if (!(p.enters < p.leaves)) return m;
    int k = p.first, last = p.last;
    while (k >= last && m.through > nothing_left) {
        vec3 place = vec3(0.0);
        uint slot = LODE_NO_BRICK;
        uvec3 at = uvec3(0u);
        vec2 of_step = vec2(0.0);
        while (k >= last) {
            of_step = step_of(p, k);
            place = place_of(p, ray, of_step);
            at = uvec3(place / across);
            slot = table_at(table_place(at, volume.shown_half));
            vec3 corner = vec3(at) * across, extent = vec3(across);
            bool empty = slot == LODE_NO_BRICK;
            if (!empty) {
                uvec3 block = uvec3(place - corner) / LODE_VOLUME_BLOCK;
                uvec4 brick = bricks_at(slot);
                uint bit = (block.z * 4u + block.y) * 4u + block.x;
                empty = ((bit < 32u ? brick.z : brick.w) >> (bit & 31u) & 1u) == 0u;
                extent = min(vec3(across) - vec3(block * LODE_VOLUME_BLOCK), vec3(LODE_VOLUME_BLOCK));
                corner += vec3(block * LODE_VOLUME_BLOCK);
            }
            if (!empty || volume.skips == 0u) break;
            // On to the first sample past the empty box. Those before lie in it.
            vec3 ends = max((corner - ray.origin) * p.inverse, (corner + extent - ray.origin) * p.inverse);
            float end = min(ends.x, min(ends.y, ends.z));
            k = min(k - 1, int(floor((volume.far_plane - end) / volume.step_length - 0.5)));
            ++m.jumps;
        }
        if (k < last) break;
        Sampled sampled = Sampled(0.0, vec3(0.0));
        if (slot != LODE_NO_BRICK) sampled = sample_of(slot, place - vec3(at) * across);
        float blend = shining_through(sampled, ray, of_step.x, of_step.y);
        m.light += m.through * (1.0 - blend) * sampled.radiance;
        m.through *= blend;
        if (sampled.density > 0.0) m.last = of_step.y;
        ++m.steps;
        --k;
    }
    m.cut = m.cut && m.through > nothing_left;
    return m;
}

uvec2 packed_result(Marched m) {
    return uvec2(packHalf2x16(m.light.rg), packHalf2x16(vec2(m.light.b, m.through)));
}

#endif
