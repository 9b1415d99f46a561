// The one shader that lights a Surface: one light with a shadow map, and what is all around, an environment or a
// hemisphere of sky and ground.
//
//   Walter, Marschner, Li, Torrance, "Microfacet models for refraction through rough surfaces", EGSR 2007 (GGX)
//   Heitz, "Understanding the masking-shadowing function in microfacet-based BRDFs", JCGT 2014 (the joint function)
//   Schlick, "An inexpensive BRDF model for physically-based rendering", Computer Graphics Forum 1994
//   Karis, "Physically based shading on mobile", 2014 (reflections of all that is around: the fit of their share)
#ifndef LODESTONE_LIGHTING_GLSL
#define LODESTONE_LIGHTING_GLSL

#include "frame/environment.glsl"
#include "shared/frame.glsl"
#include "shared/light_grid.glsl"
#include "shared/materials.glsl"

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

// What a material of metal and dielectric does with light (glTF 2.0, appendix B).
struct Reflectance {
    vec3 diffuse, specular;  // specular: seen straight on
    float alpha;             // of GGX, the square of the roughness
};

Reflectance reflectance_of(vec3 base, float metallic, float roughness) {
    const float dielectric = 0.04;
    float alpha = max(roughness, LODE_SMOOTHEST);
    return Reflectance(base * (1.0 - metallic), mix(vec3(dielectric), base, metallic), alpha * alpha);
}

// Of the light from one direction: times its irradiance, what goes to the eye. cosine: between normal and light, above 0.
vec3 reflected_light(Reflectance r, vec3 normal, vec3 to_eye, vec3 to_light, float cosine) {
    vec3 halfway = normalize(to_eye + to_light);
    float a2 = r.alpha * r.alpha, nh = clamp(dot(normal, halfway), 0.0, 1.0), nv = max(dot(normal, to_eye), 1e-4);
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float shadowed = cosine * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(cosine * cosine * (1.0 - a2) + a2);
    float lobe = a2 / (3.14159265 * d * d) * 0.5 / shadowed;
    vec3 fresnel = r.specular + (1.0 - r.specular) * pow(1.0 - clamp(dot(to_eye, halfway), 0.0, 1.0), 5.0);
    return (1.0 - fresnel) * r.diffuse / 3.14159265 + fresnel * lobe;
}

// The light of sky and ground: as bright all over each, so a matte surface gets a mean by the height of its normal.
vec3 hemisphere(float height) { return mix(frame.ground_colour.rgb, frame.sky_colour.rgb, height * 0.5 + 0.5); }

// Of sky and ground. The rougher, the wider the horizon.
vec3 reflected_hemisphere(Reflectance r, vec3 normal, vec3 to_eye) {
    float roughness = sqrt(r.alpha), nv = clamp(dot(normal, to_eye), 0.0, 1.0);
    vec4 fit = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float steep = min(fit.x * fit.x, exp2(-9.28 * nv)) * fit.x + fit.y;
    vec2 share = vec2(-1.04, 1.04) * steep + fit.zw;
    vec3 seen = reflect(-to_eye, normal);
    float height = clamp(mix(seen.y / max(r.alpha, 0.02), normal.y, r.alpha), -1.0, 1.0);
    return r.diffuse * (1.0 - r.specular) * hemisphere(normal.y) + (r.specular * share.x + share.y) * hemisphere(height);
}

bool has_environment() { return scene_has(LODE_LOOKS_ENVIRONMENT) && frame.environment_levels > 0.0; }
// What a matte surface sees of what is all around.
vec3 seen_around(vec3 normal) { return has_environment() ? environment_seen(normal) : hemisphere(normal.y); }
// What goes to the eye of it.
vec3 reflected_around(Reflectance r, vec3 normal, vec3 to_eye) {
    if (!has_environment()) return reflected_hemisphere(r, normal, to_eye);
    float roughness = sqrt(r.alpha);
    vec4 share = environment_shares(clamp(dot(normal, to_eye), 0.0, 1.0), roughness);
    return r.diffuse * (1.0 - r.specular) * (1.0 - share.z) * environment_seen(normal) +
           (r.specular * share.x + share.y) * environment_mirrored(normal, to_eye, roughness, share.w);
}

// Metal, roughness, and what is left of the light from all around.
vec3 metallic_roughness_occlusion(Surface s, Look look) {
    int texel = LODE_MATERIAL_TEXELS * int(s.material);
    vec2 factors = uintBitsToFloat(texelFetch(material_texels, texel + 2).xy);
    float occlusion = 1.0;
    if (s.baked) {
        float strength = uintBitsToFloat(texelFetch(material_texels, texel + 1).w);
        return vec3(factors * s.baked_surface.zy, 1.0 + strength * (s.baked_surface.x - 1.0));
    }
    if (scene_has(1u << LODE_TEXTURE_METALLIC_ROUGHNESS) && (look.textures & (1u << LODE_TEXTURE_METALLIC_ROUGHNESS)) != 0u)
        factors *= texture_at(s.material, LODE_TEXTURE_METALLIC_ROUGHNESS, s).bg;
    if (scene_has(1u << LODE_TEXTURE_OCCLUSION) && (look.textures & (1u << LODE_TEXTURE_OCCLUSION)) != 0u) {
        float strength = uintBitsToFloat(texelFetch(material_texels, texel + 1).w);
        occlusion = 1.0 + strength * (texture_at(s.material, LODE_TEXTURE_OCCLUSION, s).r - 1.0);
    }
    return vec3(factors, occlusion);
}

vec3 emission_of(Surface s, Look look) {
    if (!scene_has(LODE_LOOKS_EMISSION)) return vec3(0.0);
    vec3 emission = uintBitsToFloat(texelFetch(material_texels, LODE_MATERIAL_TEXELS * int(s.material) + 1).rgb);
    if (s.baked) return emission * s.baked_emission;
    if (scene_has(1u << LODE_TEXTURE_EMISSION) && (look.textures & (1u << LODE_TEXTURE_EMISSION)) != 0u)
        emission *= texture_at(s.material, LODE_TEXTURE_EMISSION, s).rgb;
    return emission;
}

// What a debug view shows in place of the surface's colour.
vec3 debug_colour(Surface s, vec3 albedo) {
    if (debug_view() == LODE_DEBUG_LEVEL) albedo = colour_of_share(s.level);
    if (debug_view() == LODE_DEBUG_TRIANGLE) albedo = colour_of_number(s.triangle);
    if (debug_view() == LODE_DEBUG_UV) {
        vec2 cell = floor(s.uv.at * 32.0);
        albedo = mix(vec3(0.9), vec3(fract(s.uv.at), 0.2), 0.35 + 0.5 * mod(cell.x + cell.y, 2.0));
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
    return albedo;
}

// Whether a debug view shows numbers of the material without any light, as they are, of what is blended, too.
bool shows_channel() {
    return debug_view() == LODE_DEBUG_NORMAL ||
           (debug_view() >= LODE_DEBUG_BASE_COLOUR && debug_view() <= LODE_DEBUG_EMISSION);
}
// What it shows.
vec3 debug_channel(Surface s, Look look, vec3 normal) {
    if (debug_view() == LODE_DEBUG_NORMAL) return normal * 0.5 + 0.5;
    if (debug_view() == LODE_DEBUG_BASE_COLOUR) return look.base;
    if (debug_view() == LODE_DEBUG_ALPHA) return vec3(look.alpha_mode == LODE_ALPHA_OPAQUE ? 1.0 : look.alpha);
    if (debug_view() == LODE_DEBUG_METALLIC) return metallic_roughness_occlusion(s, look).xxx;
    if (debug_view() == LODE_DEBUG_ROUGHNESS) return metallic_roughness_occlusion(s, look).yyy;
    if (debug_view() == LODE_DEBUG_OCCLUSION) return metallic_roughness_occlusion(s, look).zzz;
    return emission_of(s, look);
}

// Whether a normal is that of the other side. It tells by itself; where it is nearly upright to the way to the eye, the
// triangle tells: a normal between its corners' may point away from the eye that sees its front.
bool is_turned(Surface s, vec3 to_eye) {
    const float upright = 0.5;  // cosine
    return dot(s.normal, to_eye) < (s.front ? -upright : upright);
}

// Linear colour of the surface as seen from the view being drawn.
vec3 lit(Surface s, Look look) {
    vec3 to_eye = normalize(frame.views[draw_constants.view].eye.xyz - s.position);
    vec3 normal = s.normal, of_shape = normal;
    if (scene_has(1u << LODE_TEXTURE_NORMAL) && !s.baked && (look.textures & (1u << LODE_TEXTURE_NORMAL)) != 0u)
        normal = mapped_normal(s, normal);
    if (shows_both_sides() && (frame.double_sided != 0u || look.two_sided) && is_turned(s, to_eye)) {
        // What is a bump on one side is a dent on the other.
        normal = -normal;
        of_shape = -of_shape;
    }

    vec3 albedo = look.base;
    // Bare geometry: light stone, so that shading shows.
    if (look.bare) albedo = vec3(0.5);
    albedo = debug_colour(s, albedo);
    if (shows_channel()) return debug_channel(s, look, normal);
    if (scene_has(LODE_LOOKS_UNLIT) && look.shading == LODE_SHADING_UNLIT) return albedo;

    float towards_light = max(dot(normal, frame.to_light.xyz), 0.0);
    vec3 direct = vec3(towards_light > 0.0 ? towards_light * light_reaching(s.position, of_shape) : 0.0);
    if (beside_effect) direct *= light_shining_through(s.position);
    if (scene_has(LODE_LOOKS_METALLIC_ROUGHNESS) && look.shading == LODE_SHADING_METALLIC_ROUGHNESS) {
        vec3 own = metallic_roughness_occlusion(s, look);
        Reflectance r = reflectance_of(albedo, own.x, own.y);
        vec3 sum = own.z * reflected_around(r, normal, to_eye) + emission_of(s, look);
        if (towards_light <= 0.0) return sum;
        return sum + reflected_light(r, normal, to_eye, frame.to_light.xyz, towards_light) * direct * frame.light_colour.rgb;
    }
    vec3 ambient = seen_around(normal);
    vec3 halfway = normalize(to_eye + frame.to_light.xyz);
    float gloss = 0.04 * pow(max(dot(normal, halfway), 0.0), 24.0);
    return albedo * (ambient + direct * frame.light_colour.rgb / 3.14159265) + gloss * direct * frame.light_colour.rgb +
           emission_of(s, look);
}

// What the colour stage writes for a point of the surface; nothing where the pass does not draw it. alpha marks coverage.
vec4 shown(Surface s) {
    Look look = look_of(s);
    // What is masked is not there any more: no depth is left of it to be equal to.
    if (scene_has(LODE_LOOKS_BLEND) && !is_drawn(look)) discard;
    return vec4(lit(s, look), blending && !shows_channel() ? clamp(look.alpha, 0.0, 1.0) : 1.0);
}

#endif
