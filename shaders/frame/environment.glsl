// Light from far away all around (src/base/looks/environment.h).
//
//   Karis, "Real shading in Unreal Engine 4", SIGGRAPH 2013 course
//   Ramamoorthi, Hanrahan, "An efficient representation for irradiance environment maps", SIGGRAPH 2001
//   Lagarde, de Rousiers, "Moving Frostbite to physically based rendering", SIGGRAPH 2014 course (that rough surfaces
//   mirror most from nearer to the normal)
#ifndef LODESTONE_ENVIRONMENT_GLSL
#define LODESTONE_ENVIRONMENT_GLSL

#include "shared/frame.glsl"
#include "shared/materials.h"

layout(set = 0, binding = LODE_ENVIRONMENT) uniform samplerCube environment;
layout(set = 0, binding = LODE_REFLECTED_SHARES) uniform sampler2D reflected_shares;

// The mean radiance that a matte surface sees.
vec3 environment_seen(vec3 n) {
    vec3 sum = frame.environment_matte[0].rgb + frame.environment_matte[1].rgb * n.y + frame.environment_matte[2].rgb * n.z +
               frame.environment_matte[3].rgb * n.x + frame.environment_matte[4].rgb * (n.x * n.y) +
               frame.environment_matte[5].rgb * (n.y * n.z) + frame.environment_matte[6].rgb * (3.0 * n.z * n.z - 1.0) +
               frame.environment_matte[7].rgb * (n.x * n.z) + frame.environment_matte[8].rgb * (n.x * n.x - n.y * n.y);
    return max(sum, 0.0);
}

// What a surface mirrors. share: of Environment::shares, where from. Between two levels what changes grows about with the
// width of the lobe, which is the square of the roughness and so the cube of a level.
vec3 environment_mirrored(vec3 normal, vec3 to_eye, float roughness, float share) {
    float last = frame.environment_levels - 1.0, at = last * pow(roughness, 1.0 / LODE_LEVELS_BY_ROUGHNESS), level = min(floor(at), last - 1.0);
    vec3 cubes = vec3(level, level + 1.0, at);
    cubes *= cubes * cubes;
    return textureLod(environment, mix(normal, reflect(-to_eye, normal), share), level + (cubes.z - cubes.x) / (cubes.y - cubes.x)).rgb;
}

// Environment::shares. cosine: between normal and eye.
vec4 environment_shares(float cosine, float roughness) {
    vec2 texels = vec2(textureSize(reflected_shares, 0));
    vec2 at = (vec2(cosine, roughness) * (texels - 1.0) + 0.5) / texels;
    return textureLod(reflected_shares, at, 0.0);
}

#endif
