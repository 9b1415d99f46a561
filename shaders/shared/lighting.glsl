// The one shader that lights a Surface: a hemisphere of sky and ground and one light with a shadow map.
#ifndef LODESTONE_LIGHTING_GLSL
#define LODESTONE_LIGHTING_GLSL

#include "shared/frame.glsl"
#include "shared/light_grid.glsl"
#include "shared/surface.glsl"

vec3 linear_from_srgb(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}

// A colour for a number; near numbers get unlike colours.
vec3 colour_of_number(uint n) {
    n = (n ^ 61u) ^ (n >> 16);
    n *= 9u;
    n ^= n >> 4;
    n *= 0x27d4eb2du;
    n ^= n >> 15;
    return 0.25 + 0.75 * vec3(float(n & 255u), float((n >> 8) & 255u), float((n >> 16) & 255u)) / 255.0;
}

// Blue (full detail) through green to red (coarsest).
vec3 colour_of_share(float t) {
    return clamp(vec3(2.0 * t - 0.6, 1.0 - abs(2.2 * t - 1.0), 1.0 - 2.0 * t), 0.05, 1.0);
}

// The share of light that reaches the point: 3x3 percentage-closer filtering (Reeves, Salesin, Cook, SIGGRAPH 1987), the
// point moved along its normal by what a texel may hide.
float light_reaching(vec3 position, vec3 normal) {
    if (frame.shadow_view >= LODE_MOST_VIEWS) return 1.0;
    float slope = 1.0 - clamp(dot(normal, frame.to_light.xyz), 0.0, 1.0);
    vec3 lifted = position + normal * frame.shadow_texel * (1.0 + 2.0 * slope) + frame.to_light.xyz * frame.shadow_texel * 0.5;
    vec4 clip = frame.views[frame.shadow_view].world_to_clip * vec4(lifted, 1.0);
    vec2 uv = clip.xy * 0.5 + 0.5;
    if (any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0)))) return 1.0;
    vec2 texel = 1.0 / vec2(textureSize(shadow_depth, 0));
    float lit = 0.0;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            // Reversed depth: what is nearer to the light has the larger value.
            lit += clip.z >= textureLod(shadow_depth, uv + vec2(x, y) * texel, 0.0).r ? 1.0 : 0.0;
        }
    }
    return lit / 9.0;
}

// Linear colour of the surface as seen from the view being drawn.
vec3 lit(Surface s) {
    vec3 to_eye = normalize(frame.views[draw_constants.view].eye.xyz - s.position);
    vec3 normal = s.normal;
    if (frame.double_sided != 0u && dot(normal, to_eye) < 0.0) normal = -normal;

    MaterialConstants material = material_at(s.material);
    vec3 albedo = linear_from_srgb(s.colour.rgb) * material.base_colour.rgb;
    if (material.layer >= 0) albedo *= textureGrad(textures, vec3(s.uv, float(material.layer)), s.uv_dx, s.uv_dy).rgb;
    // Bare geometry, white all over (interpolation may leave it a hair below): light stone, so that shading shows.
    bool bare = material.layer < 0 && all(greaterThan(min(s.colour, material.base_colour), vec4(0.999)));
    if (bare) albedo = vec3(0.5);

    if (debug_view() == LODE_DEBUG_LEVEL) albedo = colour_of_share(s.level);
    if (debug_view() == LODE_DEBUG_TRIANGLE) albedo = colour_of_number(s.triangle);
    if (debug_view() == LODE_DEBUG_UV) {
        vec2 cell = floor(s.uv * 32.0);
        albedo = mix(vec3(0.9), vec3(fract(s.uv), 0.2), 0.35 + 0.5 * mod(cell.x + cell.y, 2.0));
    }
    if (debug_view() == LODE_DEBUG_MATERIAL) albedo = colour_of_number(s.material + 1u);
    if (debug_view() == LODE_DEBUG_CHART) albedo = colour_of_number(s.chart);
    if (debug_view() == LODE_DEBUG_PAGE) albedo = colour_of_number(s.page);
    if (debug_view() == LODE_DEBUG_MISSING)
        albedo = s.missing > 0.0 ? vec3(0.9, 0.35 / s.missing, 0.05) : vec3(0.35);
    // An eighth of a pixel is blue, a pixel green, eight are red; samples half or twice as far apart as the mean, likewise.
    if (debug_view() == LODE_DEBUG_ERROR)
        albedo = s.error < 0.0 ? vec3(0.35) : colour_of_share(clamp(0.5 + log2(max(s.error, 1e-6)) / 6.0, 0.0, 1.0));
    if (debug_view() == LODE_DEBUG_STRETCH)
        albedo = s.stretch < 0.0 ? vec3(0.35) : colour_of_share(clamp(0.5 + log2(max(s.stretch, 1e-6)) / 2.0, 0.0, 1.0));
    if (debug_view() == LODE_DEBUG_LEAF)
        albedo = s.leaf != 0u ? colour_of_number(s.page) * vec3(0.5, 1.0, 0.6) : vec3(0.35);
    if (debug_view() == LODE_DEBUG_MISSES) {
        albedo = s.mark == LODE_NO_MARKS
                     ? vec3(0.35)
                     : colour_of_share(float(triangle_marks[s.mark >> 2] >> (8u * (s.mark & 3u)) & 255u) / 3.0);
    }
    if (debug_view() == LODE_DEBUG_NORMAL) return normal * 0.5 + 0.5;

    float towards_light = max(dot(normal, frame.to_light.xyz), 0.0);
    vec3 direct = vec3(towards_light > 0.0 ? towards_light * light_reaching(s.position, normal) : 0.0);
    if (beside_effect) direct *= light_shining_through(s.position);
    vec3 ambient = mix(frame.ground_colour.rgb, frame.sky_colour.rgb, normal.y * 0.5 + 0.5);
    vec3 halfway = normalize(to_eye + frame.to_light.xyz);
    float gloss = 0.04 * pow(max(dot(normal, halfway), 0.0), 24.0);
    return albedo * (ambient + direct * frame.light_colour.rgb / 3.14159265) + gloss * direct * frame.light_colour.rgb;
}

#endif
