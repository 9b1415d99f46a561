#version 460
#extension GL_GOOGLE_include_directive : require
// Indexed meshes of which some have two sets of texture coordinates.
#define LODE_TWO_UVS
#include "mesh/mesh_vert.glsl"
