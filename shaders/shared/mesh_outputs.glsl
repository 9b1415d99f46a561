// What vertices of indexed meshes pass on to shaders/mesh/mesh.frag.
#ifndef LODESTONE_MESH_OUTPUTS_GLSL
#define LODESTONE_MESH_OUTPUTS_GLSL

#include "shared/frame.glsl"
#include "shared/surface.glsl"

layout(location = 0) out vec3 out_position;
layout(location = 1) out vec3 out_normal;
layout(location = 2) out vec2 out_uv;
layout(location = 3) out vec4 out_colour;
layout(location = 4) flat out uint out_material;

// The depth pre-pass and the colour pass must agree to the last bit.
invariant gl_Position;

// Object space; the normal need not be of unit length.
void pass_on(vec3 position, vec3 normal, vec2 uv, vec4 colour, uint material) {
    uint id = instance_ids[gl_InstanceIndex];
    vec4 world = instances[id].object_to_world * vec4(position, 1.0);
    gl_Position = frame.views[draw_constants.view].world_to_clip * world;
    out_position = world.xyz;
    out_normal = mat3(instances[id].normal_to_world) * normal;
    out_uv = uv;
    out_colour = colour;
    out_material = material + instances[id].first_material;
}

#endif
