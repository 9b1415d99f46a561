// Geomorphs of progressive meshes (lod/lod_source.cpp, shaders/lod/morph.vert), declared once for C++ and GLSL.
#ifndef LODESTONE_LOD_MORPH_H
#define LODESTONE_LOD_MORPH_H

// Set 1, beside LODE_MESH_FURTHER.
#define LODE_LOD_VERTICES 0  // MeshVertex, as words, by place (lod/asset/vertex_places.h); all assets'
#define LODE_LOD_PARENTS 1   // by place: that of what the wedge becomes when it goes, and the wedge; all assets'

#define LODE_LOD_VERTEX_WORDS 8
#define LODE_LOD_PARENT_WORDS 2

// Draw::words, after those of indexed meshes (frame/indexed_mesh.h).
#define LODE_LOD_WORD_ARRIVED 3  // a wedge of this number would be at its parent, and those before are on their way
#define LODE_LOD_WORD_STAYING 4  // wedges at the level that is morphed to; those from here on are on their way
#define LODE_LOD_WORD_FIRST 5    // the asset's first place

#endif
