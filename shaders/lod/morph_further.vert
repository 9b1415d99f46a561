#version 460
#extension GL_GOOGLE_include_directive : require
// Progressive meshes of which some have a second set of texture coordinates, or tangents.
#define LODE_HAS_FURTHER
#include "lod/morph_vert.glsl"
