// Vertices of indexed meshes: full, discrete and lod.
#include "mesh/outputs.glsl"
#include "shared/mesh_vertex.h"

layout(location = LODE_MESH_POSITION) in vec3 in_position;
layout(location = LODE_MESH_NORMAL) in vec2 in_normal;
layout(location = LODE_MESH_UV) in vec2 in_uv;
layout(location = LODE_MESH_COLOUR) in vec4 in_colour;
layout(location = LODE_MESH_MATERIAL) in uint in_material;

void main() {
    pass_on(in_position, unpack_normal(in_normal), in_uv, further_of(uint(gl_VertexIndex)), in_colour, in_material);
}
