#version 460
#extension GL_GOOGLE_include_directive : require
// Indexed meshes: full, discrete and lod.
#include "shared/frame.glsl"
#include "shared/mesh_vertex.h"
#include "shared/surface.glsl"

layout(location = LODE_MESH_POSITION) in vec3 in_position;
layout(location = LODE_MESH_NORMAL) in vec2 in_normal;
layout(location = LODE_MESH_UV) in vec2 in_uv;
layout(location = LODE_MESH_COLOUR) in vec4 in_colour;
layout(location = LODE_MESH_MATERIAL) in uint in_material;

layout(location = 0) out vec3 out_position;
layout(location = 1) out vec3 out_normal;
layout(location = 2) out vec2 out_uv;
layout(location = 3) out vec4 out_colour;
layout(location = 4) flat out uint out_material;

// The depth pre-pass and the colour pass must agree to the last bit.
invariant gl_Position;

void main() {
    uint id = instance_ids[gl_InstanceIndex];
    vec4 world = instances[id].object_to_world * vec4(in_position, 1.0);
    gl_Position = frame.views[draw_constants.view].world_to_clip * world;
    out_position = world.xyz;
    out_normal = mat3(instances[id].normal_to_world) * unpack_normal(in_normal);
    out_uv = in_uv;
    out_colour = in_colour;
    out_material = in_material + instances[id].first_material;
}
