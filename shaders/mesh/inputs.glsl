// The surface of indexed meshes, from what mesh/outputs.glsl passes on.
#ifndef LODESTONE_MESH_INPUTS_GLSL
#define LODESTONE_MESH_INPUTS_GLSL

#include "shared/materials.glsl"

layout(location = 0) in vec4 in_position_and_u;
layout(location = 1) in vec4 in_normal_and_v;
layout(location = 2) in vec4 in_colour;
layout(location = 3) flat in uint in_material;

Surface mesh_surface() {
    Surface s;
    s.front = gl_FrontFacing != ((in_material & LODE_MIRRORED) != 0u);
    s.leaf = 0u;
    s.position = in_position_and_u.xyz;
    s.normal = normalize(in_normal_and_v.xyz);
    s.uv = vec2(in_position_and_u.w, in_normal_and_v.w);
    s.uv_dx = dFdx(s.uv);
    s.uv_dy = dFdy(s.uv);
    s.along_u = s.along_v = vec3(0.0);
    if (scene_has(1u << LODE_TEXTURE_NORMAL)) set_along(s, dFdx(s.position), dFdy(s.position), s.uv_dx, s.uv_dy);
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
