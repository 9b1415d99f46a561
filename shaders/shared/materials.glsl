// What materials say of a point of a surface: glTF 2.0 (Khronos, 2021), section 3.9.
#ifndef LODESTONE_MATERIALS_GLSL
#define LODESTONE_MATERIALS_GLSL

#include "shared/frame.glsl"
#include "shared/materials.h"
#include "shared/surface.glsl"

layout(constant_id = LODE_TEXTURE_ARRAYS_CONSTANT) const uint texture_arrays = LODE_MOST_TEXTURE_ARRAYS;
// What is blended is drawn by itself, after everything else.
layout(constant_id = LODE_BLENDING_CONSTANT) const bool blending = false;

layout(set = 0, binding = LODE_TEXTURES) uniform sampler2DArray textures[LODE_MOST_TEXTURE_ARRAYS];

// Whether fragments tell which side is shown: where views cannot leave out all that face away.
bool fragments_have_sides() {
    return scene_has(LODE_LOOKS_ONE_SIDED) && scene_has(LODE_LOOKS_TWO_SIDED | LODE_LOOKS_MIRRORS);
}
// Whether something is seen from behind.
bool shows_both_sides() { return frame.double_sided != 0u || scene_has(LODE_LOOKS_TWO_SIDED); }
// Whether the material has to be looked at to know if a point is drawn (is_drawn). front: which side is shown.
bool may_be_absent(bool front) {
    return scene_has(LODE_LOOKS_MASK | LODE_LOOKS_BLEND) || (fragments_have_sides() && !front);
}

vec3 linear_from_srgb(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}

// A chain of comparisons: not every device can choose among images by number.
#define LODE_OF_ARRAY(number, what)                                \
    if (texture_arrays > 7u && number == 7u) return what(textures[7]); \
    if (texture_arrays > 6u && number == 6u) return what(textures[6]); \
    if (texture_arrays > 5u && number == 5u) return what(textures[5]); \
    if (texture_arrays > 4u && number == 4u) return what(textures[4]); \
    if (texture_arrays > 3u && number == 3u) return what(textures[3]); \
    if (texture_arrays > 2u && number == 2u) return what(textures[2]); \
    if (texture_arrays > 1u && number == 1u) return what(textures[1]); \
    return what(textures[0]);

vec4 texel_of_array(uint array, vec3 at, vec2 dx, vec2 dy) {
#define LODE_LOOK_UP(images) textureGrad(images, at, dx, dy)
    LODE_OF_ARRAY(array, LODE_LOOK_UP)
#undef LODE_LOOK_UP
}
vec2 texels_of_array(uint array) {
#define LODE_SIZE_OF(images) vec2(textureSize(images, 0).xy)
    LODE_OF_ARRAY(array, LODE_SIZE_OF)
#undef LODE_SIZE_OF
}

// Where one direction of a texture is looked up. margin: half of what is filtered, in textures.
float wrapped(float at, float margin, uint wrap) {
    if (wrap == LODE_WRAP_REPEAT) return at;
    if (wrap == LODE_WRAP_MIRROR) at = 1.0 - abs(2.0 * fract(0.5 * at) - 1.0);
    return clamp(at, margin, 1.0 - margin);
}

// Where a texture is looked up, for the texture coordinates of a surface.
struct TexturePlace {
    vec2 at, dx, dy;
    mat2x3 along;  // as UvSet, of the set that it is on
    mat2 turn;     // from texture coordinates' changes to its own
};

// Of texture k of a material. array: it is in.
TexturePlace texture_place(uint material, uint k, uint array, Surface s) {
    TexturePlace place = TexturePlace(s.uv.at, s.uv.dx, s.uv.dy, s.uv.along, mat2(1.0));
    uint others = LODE_LOOKS_PLACES | LODE_LOOKS_WRAPS | (k == LODE_TEXTURE_BASE_COLOUR ? 0u : LODE_LOOKS_SECOND_UVS);
    if (!scene_has(others)) return place;
    int texel = LODE_MATERIAL_TEXELS * int(material) + 4 + 2 * int(k);
    uvec4 more = texelFetch(material_texels, texel + 1);
    if (scene_has(LODE_LOOKS_SECOND_UVS) && (more.w & LODE_TEXTURE_SECOND) != 0u)
        place = TexturePlace(s.second_uv.at, s.second_uv.dx, s.second_uv.dy, s.second_uv.along, mat2(1.0));
    if ((more.w & LODE_TEXTURE_MOVED) != 0u) {
        vec4 turn = uintBitsToFloat(texelFetch(material_texels, texel));
        place.turn = mat2(turn.xy, turn.zw);
        place.at = place.turn * place.at + uintBitsToFloat(more.xy);
        place.dx = place.turn * place.dx;
        place.dy = place.turn * place.dy;
    }
    if ((more.w & 0xffffu) != 0u) {
        vec2 filtered = max(max(abs(place.dx), abs(place.dy)), 1.0 / texels_of_array(array));
        vec2 margin = min(0.5 * filtered, 0.5);
        place.at = vec2(wrapped(place.at.x, margin.x, more.w & 255u), wrapped(place.at.y, margin.y, (more.w >> 8) & 255u));
    }
    return place;
}

vec4 texture_at(uint material, uint k, uint array_and_layer, Surface s) {
    uint array = array_and_layer >> 24;
    TexturePlace place = texture_place(material, k, array, s);
    return texel_of_array(array, vec3(place.at, float(array_and_layer & 0xffffffu)), place.dx, place.dy);
}
// The same of another than the base colour's.
vec4 texture_at(uint material, uint k, Surface s) {
    return texture_at(material, k, texelFetch(material_texels, LODE_MATERIAL_TEXELS * int(material) + 5 + 2 * int(k)).z, s);
}

// What there is of a surface to be lit.
struct Look {
    vec3 base;  // linear
    float alpha;
    float alpha_cutoff;
    uint shading, alpha_mode, textures;
    bool bare;  // white all over, without a texture
    bool two_sided, front;
};

Look look_of(Surface s) {
    int texel = LODE_MATERIAL_TEXELS * int(s.material);
    vec4 colour = uintBitsToFloat(texelFetch(material_texels, texel));
    uvec4 kinds = texelFetch(material_texels, texel + 3);
    Look look;
    look.shading = kinds.x;
    look.alpha_mode = kinds.y & (LODE_TWO_SIDED - 1u);
    look.two_sided = (kinds.y & LODE_TWO_SIDED) != 0u;
    look.front = s.front;
    look.textures = kinds.w;
    look.base = (s.baked ? s.colour.rgb : linear_from_srgb(s.colour.rgb)) * colour.rgb;
    look.alpha = s.colour.a * colour.a;
    look.alpha_cutoff = 0.5;
    bool textured = scene_has(1u << LODE_TEXTURE_BASE_COLOUR) && kinds.z != LODE_NO_TEXTURE;
    if (textured && !s.baked) {
        vec4 texel_colour = texture_at(s.material, LODE_TEXTURE_BASE_COLOUR, kinds.z, s);
        look.base *= texel_colour.rgb;
        look.alpha *= texel_colour.a;
    }
    if (scene_has(LODE_LOOKS_MASK) && look.alpha_mode == LODE_ALPHA_MASK)
        look.alpha_cutoff = uintBitsToFloat(texelFetch(material_texels, texel + 2).w);
    // Interpolation may leave white a hair below.
    look.bare = look.shading == LODE_SHADING_PLAIN && !textured && !s.baked && all(greaterThan(min(s.colour, colour), vec4(0.999)));
    return look;
}

bool material_is_two_sided(uint material) {
    return (texelFetch(material_texels, LODE_MATERIAL_TEXELS * int(material) + 3).y & LODE_TWO_SIDED) != 0u;
}

bool throws_shadows() { return frame.views[draw_constants.view].eye.w == 0.0; }
// Whether a pass draws the side that is shown.
bool is_side_drawn(bool two_sided, bool front) {
    return !fragments_have_sides() || two_sided || front || frame.shows_backs != 0u || throws_shadows();
}

// Whether a pass draws the point. What is blended leaves neither depth nor, where less than half is there, a shadow.
bool is_drawn(Look look) {
    if (!is_side_drawn(look.two_sided, look.front)) return false;
    if (look.alpha_mode == LODE_ALPHA_MASK) return !blending && look.alpha >= look.alpha_cutoff;
    if (look.alpha_mode != LODE_ALPHA_BLEND) return !blending;
    return throws_shadows() ? look.alpha >= 0.5 : blending;
}

// The normal that a map tells in the frame of the surface's tangent, made upright to the normal, and of what is upright to
// both. Where there is none, it is the frame of the map's texture coordinates, as MikkTSpace (Mikkelsen, 2008) has it
// where it is made anew for each pixel: the tangent is along the first coordinate. glTF's second coordinate points down,
// green points up.
vec3 mapped_normal(Surface s, vec3 normal) {
    int texel = LODE_MATERIAL_TEXELS * int(s.material);
    uint array_and_layer = texelFetch(material_texels, texel + 5 + 2 * LODE_TEXTURE_NORMAL).z;
    TexturePlace place = texture_place(s.material, LODE_TEXTURE_NORMAL, array_and_layer >> 24, s);
    vec3 map = texel_of_array(array_and_layer >> 24, vec3(place.at, float(array_and_layer & 0xffffffu)), place.dx, place.dy).xyz;
    map = 2.0 * map - 1.0;
    map.xy *= uintBitsToFloat(texelFetch(material_texels, texel + 2).z);
    mat2x3 along = place.along * inverse(place.turn);
    bool given = s.tangent.w != 0.0;
    vec3 across = given ? s.tangent.xyz : along[0];
    vec3 tangent = across - normal * dot(normal, across);
    float size = length(tangent);
    if (!(size > 0.0) || dot(map, map) < 1e-6) return normal;
    tangent /= size;
    vec3 up = cross(normal, tangent);
    if (given ? s.tangent.w < 0.0 : dot(up, along[1]) > 0.0) up = -up;
    return normalize(tangent * map.x + up * map.y + normal * map.z);
}

#endif
