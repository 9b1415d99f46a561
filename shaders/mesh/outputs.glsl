// What vertices of indexed meshes pass on to shaders/mesh/mesh.frag.
#ifndef LODESTONE_MESH_OUTPUTS_GLSL
#define LODESTONE_MESH_OUTPUTS_GLSL

#include "mesh/further.glsl"
#include "shared/frame.glsl"
#include "shared/surface.glsl"

// Packed: rasterisers set up four numbers at the price of one.
layout(location = 0) out vec4 out_position_and_u;
layout(location = 1) out vec4 out_normal_and_v;
layout(location = 2) out vec4 out_colour;
layout(location = 3) flat out uint out_material;  // | LODE_MIRRORED
layout(location = 4) out vec2 out_second_uv;
layout(location = 5) out vec4 out_tangent;

// The depth pre-pass and the colour pass must agree to the last bit.
invariant gl_Position;

// Object space; the normal need not be of unit length.
void pass_on(vec3 position, vec3 normal, vec2 uv, Further further, vec4 colour, uint material) {
    InstanceConstants instance = instance_at(instance_id_at(gl_InstanceIndex));
    vec4 world = instance.object_to_world * vec4(position, 1.0);
    gl_Position = frame.views[draw_constants.view].world_to_clip * world;
    if (!has_fragments) return;
    out_position_and_u = vec4(world.xyz, uv.x);
    out_normal_and_v = vec4(mat3(instance.normal_to_world) * normal, uv.y);
    out_colour = colour;
    if (scene_has(LODE_LOOKS_SECOND_UVS)) out_second_uv = further.second_uv;
    if (uses_tangents()) {
        // Mirrored with its instance: so is the bitangent.
        float side = instance.mirrored != 0u ? -1.0 : 1.0;
        out_tangent = vec4(mat3(instance.object_to_world) * further.tangent.xyz, side * further.tangent.w);
    }
    out_material = (material + instance.first_material) | (instance.mirrored != 0u ? LODE_MIRRORED : 0u);
}

#endif
