#version 460
#extension GL_GOOGLE_include_directive : require
// Indexed meshes that have nothing beside their vertices.
#include "mesh/mesh_vert.glsl"
