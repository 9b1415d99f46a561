// The old textures of a mesh, resampled into its new squares.
//
// Every texel is the mean of samples in it, in linear light, each looked up (bilinearly, going on as its texture says)
// where the triangle under it has its old texture coordinates. A triangle whose texels are larger than those of its old
// texture has as many more samples. Texels of no triangle take the colour nearest to them, so that nothing bleeds in at
// borders, nor in mips.
//
// Normals are turned from the tangent frame of the old texture coordinates to that of the new ones. A frame is that of
// a triangle: across is where its texture coordinates grow, made perpendicular to the normal of the surface there; up
// is perpendicular to both.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/result.h"
#include "mesh/tri_mesh.h"
#include "vgi/unwrap/old_looks.h"
#include "vgi/unwrap/unwrap.h"

namespace lodestone::vgi {

// One image per square and look. Colours there are always; others where a texture needs them, or where materials
// differ.
struct BakedTextures {
    std::array<std::vector<Image>, look_count> by_look;  // by Look; each empty or one image per square
    bool metal = false, occlusion = false;               // what of Look::surface is of use
    float brightest = 1;                                 // by what emission goes on being multiplied
    const std::vector<Image>& of(Look look) const { return by_look[static_cast<size_t>(look)]; }
};

// Factors of materials times their textures; a material without one is its factor. resolution: texels along a side of
// each image, > 0. Colours of vertices are not in them: they go on multiplying.
BakedTextures bake_textures(const TriMesh& source, const Unwrapped& unwrapped, uint32_t squares, uint32_t resolution);

// Gives the unwrapped mesh the images, and materials that show them: for each square one, or as many as the source has
// materials that differ in what no texture says: sides, shading, what alpha does. before: the source's table.
void use_textures(TriMesh& unwrapped, BakedTextures baked, const std::vector<Material>& before);

}  // namespace lodestone::vgi
