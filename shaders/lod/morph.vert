#version 460
#extension GL_GOOGLE_include_directive : require
// Progressive meshes of one set of texture coordinates, or none.
#include "lod/morph_vert.glsl"
