// A tile's triangles as binary glTF 2.0.
//
// Positions are in steps of the atlas's lattice, and one matrix, the same to the bit in every tile, makes them metres:
// so a place is at one place on screen, whichever tiles show it. Tiles of samples alone have whole numbers of 16 bits.
// Where vertices of leaves are among them positions are floats, which hold the fractions of steps exactly.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tiles/tile_mesh.h"

namespace lodestone::tiles {

enum class Encoding {
    meshopt,    // as quantised, compressed by EXT_meshopt_compression
    quantised,  // integers, but for positions that are none; KHR_mesh_quantization
    plain,      // floats, which every reader of glTF knows
};
std::optional<Encoding> encoding_named(const std::string& name);

// Which axis of the mesh points to the sky. Tiles have z there, glTF has y.
enum class UpAxis { y, z };

struct GlbOptions {
    Encoding encoding = Encoding::meshopt;
    UpAxis up = UpAxis::y;
    std::vector<std::string> image_uris;  // per image of the atlas, from the file
};

// The file's bytes; equal input gives equal bytes.
std::vector<std::byte> encode_glb(const vgi::Atlas& atlas, TileMesh mesh, const GlbOptions& options);

}  // namespace lodestone::tiles
