#version 460
#extension GL_GOOGLE_include_directive : require
// Bricks one by one, in an order in which each can be laid over or under what is there: the source's own way. A ray's
// samples in a brick are taken far to near; what they come to is laid on the target, in half floats. A sample belongs to
// the one brick that its place is in.
//
//   "Sparse procedural volumetric rendering" (Intel, in GPU Pro 6), sections on marching, sorting and blending. There a
//   cube is drawn for each metavoxel, and the blending unit lays it on the target; here a thread goes through the bricks
//   of a batch for its pixel.
// words: [0] the place of the batch's first brick in the order, which has the first slot; [1] how many; [2] 1: nothing is
// there yet.
#include "volume/march.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

LODE_TEXELS(LODE_VOLUME_ORDER, order, uint)
layout(set = 1, binding = LODE_VOLUME_RESULT, std430) buffer ResultBlock { uvec2 result[]; };

// Light and what shines through of one brick.
vec4 marched_alone(ViewRay ray, Part p, uvec3 at, uint slot) {
    vec3 corner = vec3(at * volume.metavoxels.w);
    vec3 a = (corner - ray.origin) * p.inverse, b = (corner + float(volume.metavoxels.w) - ray.origin) * p.inverse;
    vec3 near3 = min(a, b), far3 = max(a, b);
    float enters = max(p.enters, max(near3.x, max(near3.y, near3.z)));
    float leaves = min(p.leaves, min(far3.x, min(far3.y, far3.z)));
    vec4 found = vec4(0.0, 0.0, 0.0, 1.0);
    // With a step more on either side, for what rounding does.
    if (enters > leaves + volume.step_length) return found;
    int nearest = min(p.first, int(ceil((volume.far_plane - enters) / volume.step_length)));
    int farthest = max(p.last, int(floor((volume.far_plane - leaves) / volume.step_length)) - 1);
    for (int k = farthest; k <= nearest; ++k) {
        vec2 of_step = step_of(p, k);
        vec3 place = place_of(p, ray, of_step);
        if (uvec3(place / float(volume.metavoxels.w)) != at) continue;
        Sampled sampled = sample_of(slot, place - corner);
        float blend = shining_through(sampled, ray, of_step.x, of_step.y);
        found = vec4(found.rgb * blend + sampled.radiance * (1.0 - blend), found.a * blend);
    }
    return found;
}

void main() {
    ivec2 pixel = ivec2(volume.marched.xy + gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(volume.marched.zw)))) return;
    uint number = uint(pixel.y) * volume.picture.x + uint(pixel.x);
    uvec2 target = nothing;
    if (draw_constants.words[2] == 0u) target = result[number];
    ViewRay ray = ray_of(pixel);
    Part p = part_of(ray);
    if (p.enters < p.leaves) {
        for (uint i = 0u; i < draw_constants.words[1]; ++i) {
            uint word = order_at(draw_constants.words[0] + i);
            uint brick = bricks_at(word & ~LODE_ORDERED_UNDER).x;
            vec4 drawn = marched_alone(ray, p, uvec3(brick, brick >> 10, brick >> 20) & 1023u, i);
            if (drawn.a == 1.0) continue;
            vec4 there = vec4(unpackHalf2x16(target.x), unpackHalf2x16(target.y));
            there.rgb = (word & LODE_ORDERED_UNDER) != 0u ? drawn.rgb * there.a + there.rgb : there.rgb * drawn.a + drawn.rgb;
            there.a *= drawn.a;
            target = uvec2(packHalf2x16(there.rg), packHalf2x16(there.ba));
        }
    }
    result[number] = target;
}
