// The materials of a glTF file, and the images that they use.
#pragma once

#include <tiny_gltf.h>

#include <glm/mat3x2.hpp>
#include <map>
#include <string>
#include <vector>

#include "mesh/io/formats.h"

namespace lodestone {

// The texture coordinates that wedges of a material get: a set of the file's, moved (KHR_texture_transform), and
// another as it is.
struct GltfTexcoords {
    int set = 0;                                 // TEXCOORD_set
    glm::dmat3x2 place{{1, 0}, {0, 1}, {0, 0}};  // times (u, v, 1)
    int second = -1;                             // TEXCOORD_second; -1: no texture is on a second set
    bool operator==(const GltfTexcoords&) const = default;
};

// Files that a document names and that could not be read, and why.
using GltfNotRead = std::map<std::string, std::string>;

// Fills the mesh's table, of which the first is that of primitives without a material, and decodes the images that are
// used, each once. Returns what wedges get, per material of the file: the texture coordinates of its base colour, where
// it has none those of its first texture; and the next set that a texture is on. Textures that cannot go with these are
// left out, and a warning says so.
// Throws GltfFault where there are too many.
std::vector<GltfTexcoords> read_gltf_materials(const SourceFile& file, const ReadOptions& options,
                                               const tinygltf::Model& model, const GltfNotRead& not_read, TriMesh& mesh,
                                               ReadReport& report);

// Warns of extensions by which materials look otherwise than they are read.
void warn_of_material_extensions(const SourceFile& file, const tinygltf::Model& model, ReadReport& report);

// Takes off the mesh the images of materials that it has nothing of.
void drop_unused_images(TriMesh& mesh);

}  // namespace lodestone
