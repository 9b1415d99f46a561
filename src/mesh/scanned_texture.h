// A texture in many small pieces, as photogrammetry leaves it.
#pragma once

#include <cstdint>

#include "mesh/tri_mesh.h"

namespace lodestone {

inline constexpr uint64_t triangles_per_fragment = 20;

// Cuts the surface of a closed mesh, every point of which is seen from the origin, into a fragment for each
// triangles_per_fragment triangles, and gives each a square of its own, turned at random, in one image of up to
// 4096 x 4096 texels. The image is painted as stone, by a function of the place on the surface; the paint goes on in
// gutters of at least two texels. What the mesh had of texture coordinates, materials and images is replaced; normals
// stay.
void lay_out_as_scanned(TriMesh& mesh, uint64_t seed);

}  // namespace lodestone
