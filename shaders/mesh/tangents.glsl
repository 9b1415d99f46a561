// Whether tangents of indexed meshes are drawn with.
#ifndef LODESTONE_TANGENTS_GLSL
#define LODESTONE_TANGENTS_GLSL

#include "shared/frame.glsl"
#include "shared/mesh_vertex.h"

layout(constant_id = LODE_MESH_TANGENTS_CONSTANT) const bool has_tangents = false;

bool uses_tangents() { return has_tangents && scene_has(1u << LODE_TEXTURE_NORMAL); }

#endif
