// The old textures of a mesh, resampled into its new squares.
//
// Every texel is the mean of samples in it, in linear light, each looked up (bilinearly, repeating) where the triangle
// under it has its old texture coordinates. A triangle whose texels are larger than those of its old texture has as
// many more samples. Texels of no triangle take the colour nearest to them, so that nothing bleeds in at borders, nor
// in mips.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "mesh/tri_mesh.h"
#include "vgi/unwrap/unwrap.h"

namespace lodestone::vgi {

// Colours of materials times their textures; a material without one is its colour. resolution: texels along a side of
// each image, > 0. Colours of vertices are not in them: they go on multiplying.
std::vector<Image> bake_textures(const TriMesh& source, const Unwrapped& unwrapped, uint32_t squares,
                                 uint32_t resolution);

// Gives the mesh the images, one per square, and materials that show them: one per square, or two where the source has
// double-sided materials and others. Whether any texel lets light through decides nothing here: alpha stays.
void use_textures(TriMesh& unwrapped, const std::vector<Image>& images, size_t materials_before);

}  // namespace lodestone::vgi
