// What is baked into an atlas, as textures of a mesh that is extracted of it.
#pragma once

#include "vgi/asset/atlas.h"
#include "vgi/extract/chart_places.h"
#include "vgi/extract/extract.h"

namespace lodestone::vgi {

// Gives a mesh with coordinates of `places` the images, and its materials the textures. Where normals are those of
// maps, the wedges that are samples get normals of the triangles around them, and a map says what the atlas has, in the
// tangent frames of triangles (mesh/textures/tangent_frame.h).
void use_baked_images(const Atlas& atlas, const ChartPlaces& places, ExtractedMesh& extracted);

}  // namespace lodestone::vgi
