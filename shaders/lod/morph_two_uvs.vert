#version 460
#extension GL_GOOGLE_include_directive : require
// Progressive meshes of which some have two sets of texture coordinates.
#define LODE_TWO_UVS
#include "lod/morph_vert.glsl"
