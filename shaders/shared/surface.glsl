// What a backend's fragment shader says about the point it covers; lighting.glsl lights it, the same for every backend.
#ifndef LODESTONE_SURFACE_GLSL
#define LODESTONE_SURFACE_GLSL

#include "shared/octahedral.glsl"

// Texture coordinates of a set.
struct UvSet {
    vec2 at;
    vec2 dx, dy;  // how they change from pixel to pixel
    // World space, of any length: which way the first and the second grow along the surface. Where the scene has maps
    // of normals; 0 where it is not known.
    mat2x3 along;
};
UvSet no_uvs() { return UvSet(vec2(0.0), vec2(0.0), vec2(0.0), mat2x3(0.0)); }

struct Surface {
    vec3 position;     // world space
    vec3 normal;       // world space, unit length
    UvSet uv;          // of the first set
    UvSet second_uv;   // where the scene has textures on it
    // The mesh's own: world space, of any length, and w above 0 where the bitangent is along cross(normal, tangent),
    // below 0 where it is against it. 0 where there is none: the frame of maps of normals is then that of uv.along.
    vec4 tangent;
    vec4 colour;    // sRGB as stored with the vertex, linear where `baked`; and alpha
    uint material;  // into the scene's materials
    // What textures say is in `colour` and `normal`, and in these: occlusion, roughness, metal; linear emission. Else
    // it is looked up.
    bool baked;
    vec3 baked_surface, baked_emission;
    float level;    // 0 full detail .. 1 coarsest
    uint chart;     // a number that differs between neighbouring charts, 0 where there are none
    uint page;      // a number that differs between neighbouring pages, 0 where there are none
    float missing;  // levels coarser than wanted, because the page is not there
    float error;    // pixels: of a level, what it is off by; of samples, what leaving them out would cost; below 0: not known
    float stretch;  // times as far apart as the mean, that samples are; below 0 where there are none
    bool front;     // whether the front of the triangle is seen
    uint leaf;      // 1 where triangles are the source's own, of a leaf
    uint triangle;  // its number in the draw
    uint mark;      // its place in triangle_marks, LODE_NO_MARKS where it has none
};

// UvSet::along from two ways along a surface, and what the texture coordinates change on them.
mat2x3 along_of(vec3 first, vec3 second, vec2 uv_first, vec2 uv_second) {
    float turned = uv_first.x * uv_second.y - uv_second.x * uv_first.y;
    float side = turned < 0.0 ? -1.0 : turned > 0.0 ? 1.0 : 0.0;
    return side * mat2x3(first * uv_second.y - second * uv_first.y, second * uv_first.x - first * uv_second.x);
}

vec3 unpack_normal(vec2 packed_normal) { return normalize(unfolded(packed_normal)); }

#endif
