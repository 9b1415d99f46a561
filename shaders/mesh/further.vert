#version 460
#extension GL_GOOGLE_include_directive : require
// Indexed meshes of which some have a second set of texture coordinates, or tangents.
#define LODE_HAS_FURTHER
#include "mesh/mesh_vert.glsl"
