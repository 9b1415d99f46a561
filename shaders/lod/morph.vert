#version 460
#extension GL_GOOGLE_include_directive : require
// Progressive meshes that have nothing beside their vertices.
#include "lod/morph_vert.glsl"
