// Debug views of volumes.
#ifndef LODESTONE_VOLUME_DEBUG_GLSL
#define LODESTONE_VOLUME_DEBUG_GLSL

#include "volume/march.glsl"

vec3 volume_share_colour(float t) {
    return clamp(vec3(2.0 * t - 0.6, 1.0 - abs(2.2 * t - 1.0), 1.0 - 2.0 * t), 0.05, 1.0);
}

// The metavoxel in which the ray first meets something, as a colour.
vec3 colour_of_brick(Marched m, ViewRay ray) {
    uint h = hash_of_place(uvec3(ray.origin + ray.along * max(m.last - 0.5 * volume.step_length, 0.0)) /
                           volume.metavoxels.w);
    return 0.2 + 0.8 * vec3(uvec3(h, h >> 8, h >> 16) & 255u) / 255.0;
}

Marched shown_as(Marched m, ViewRay ray) {
    bool any_of_it = m.steps > 0u;
    float seen = 1.0 - m.through;
    if (frame.debug_view == LODE_DEBUG_VOLUME_BRICKS) m.light = seen * colour_of_brick(m, ray);
    // Samples that found something to look at, against the jumps over what is empty.
    if (frame.debug_view == LODE_DEBUG_VOLUME_OCCUPANCY && m.steps + m.jumps > 0u) {
        m.light = 0.8 * volume_share_colour(float(m.steps) / float(m.steps + m.jumps));
        m.through = 0.2;
    }
    // Of what comes towards the eye, without how dense it is.
    if (frame.debug_view == LODE_DEBUG_VOLUME_LIGHT && any_of_it) {
        m.light = m.light / max(seen, 1e-3);
        m.through = seen > 0.01 ? 0.0 : 1.0;
        m.light *= 1.0 - m.through;
    }
    if (frame.debug_view == LODE_DEBUG_VOLUME_STEPS && any_of_it) {
        m.light = 0.8 * volume_share_colour(min(float(m.steps) / 256.0, 1.0));
        m.through = 0.2;
    }
    return m;
}

#endif
