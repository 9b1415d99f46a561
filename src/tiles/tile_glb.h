// A tile's triangles as binary glTF 2.0.
//
// Positions are the atlas's own lattice points, and one matrix, the same to the bit in every tile, makes them metres:
// so a sample is at one place on screen, whichever tiles show it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tiles/tile_mesh.h"

namespace lodestone::tiles {

enum class Encoding {
    meshopt,    // integers, compressed by EXT_meshopt_compression; KHR_mesh_quantization
    quantised,  // integers; KHR_mesh_quantization
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
