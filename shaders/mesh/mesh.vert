#version 460
#extension GL_GOOGLE_include_directive : require
// Indexed meshes of one set of texture coordinates, or none.
#include "mesh/mesh_vert.glsl"
