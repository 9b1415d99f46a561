// Writes meshes: PLY (binary little endian), OBJ with its .mtl, GLB. The file appears whole or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// What is written beside what the format asks for.
struct WriteOptions {
    // A kind of image file.
    enum class Textures {
        png,   // without loss
        jpeg,  // without alpha
        webp,  // in GLB by EXT_texture_webp alone, which a reader must know then
    };
    Textures textures = Textures::png;  // what textures are written as
    int quality = 92;                   // of JPEG and WebP, 1 .. 100; WebP of 100 loses nothing
    // How GLB has vertices and triangles.
    enum class Encoding {
        plain,      // floats
        quantised,  // KHR_mesh_quantization: 16 bits a number
        meshopt,    // quantised, and EXT_meshopt_compression
    };
    Encoding encoding = Encoding::plain;  // of GLB; other formats have floats
    bool exact_uvs = false;               // texture coordinates stay floats, whatever the encoding
};

// Fault::usage where the name's extension is none that is written.
Result<void> check_write(const std::filesystem::path& path);

// What of the mesh a file of that name will not hold, a line each: of its materials and textures, and of wedges what
// GLB alone holds.
std::vector<std::string> lost_in_writing(const TriMesh& mesh, const std::filesystem::path& path);

// Chooses the format by extension: .ply, .obj, .glb; anything else is Fault::usage. Triangles and vertices keep their
// order. PLY writes one vertex per wedge (seams become duplicated positions, bit for bit equal); OBJ keeps positions
// shared; GLB writes one primitive per material with images embedded.
Result<void> write_mesh(const TriMesh& mesh, const std::filesystem::path& path, const WriteOptions& options = {});

}  // namespace lodestone
