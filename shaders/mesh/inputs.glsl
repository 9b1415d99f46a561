// The surface of indexed meshes, from what mesh/outputs.glsl passes on.
#ifndef LODESTONE_MESH_INPUTS_GLSL
#define LODESTONE_MESH_INPUTS_GLSL

#include "mesh/tangents.glsl"
#include "shared/materials.glsl"

layout(location = 0) in vec4 in_position_and_u;
layout(location = 1) in vec4 in_normal_and_v;
layout(location = 2) in vec4 in_colour;
layout(location = 3) flat in uint in_material;
layout(location = 4) in vec2 in_second_uv;  // where the scene has textures on it
layout(location = 5) in vec4 in_tangent;    // where the scene uses tangents

bool front_here() { return gl_FrontFacing != ((in_material & LODE_MIRRORED) != 0u); }

UvSet uv_set(vec2 at, vec3 position) {
    UvSet set = UvSet(at, dFdx(at), dFdy(at), mat2x3(0.0));
    if (scene_has(1u << LODE_TEXTURE_NORMAL)) set.along = along_of(dFdx(position), dFdy(position), set.dx, set.dy);
    return set;
}

Surface mesh_surface() {
    Surface s;
    s.front = front_here();
    s.leaf = 0u;
    s.position = in_position_and_u.xyz;
    s.normal = normalize(in_normal_and_v.xyz);
    s.uv = uv_set(vec2(in_position_and_u.w, in_normal_and_v.w), s.position);
    s.second_uv = no_uvs();
    if (scene_has(LODE_LOOKS_SECOND_UVS)) s.second_uv = uv_set(in_second_uv, s.position);
    s.tangent = vec4(0.0);
    if (uses_tangents()) s.tangent = in_tangent;
    s.colour = in_colour;
    s.material = in_material & ~LODE_MIRRORED;
    s.baked = false;
    s.baked_surface = s.baked_emission = vec3(1.0);
    s.level = float(draw_constants.words[0]) / max(float(draw_constants.words[1]) - 1.0, 1.0);
    s.chart = 0u;
    s.page = 0u;
    s.missing = 0.0;
    s.error = uintBitsToFloat(draw_constants.words[2]) / distance(s.position, frame.views[draw_constants.view].eye.xyz);
    s.stretch = -1.0;
    s.triangle = uint(gl_PrimitiveID);
    s.mark = LODE_MARK_OF_PRIMITIVE;
    return s;
}

#endif
