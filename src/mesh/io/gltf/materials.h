// The materials of a glTF file, and the images that they use.
#pragma once

#include <tiny_gltf.h>

#include <glm/mat3x2.hpp>
#include <map>
#include <set>
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

struct GltfMaterials {
    std::vector<GltfTexcoords> texcoords;   // what wedges get, per material of the file
    std::set<std::string> told_extensions;  // that are not read, and of which a warning says so already
};

// Fills the mesh's table, of which the first is that of primitives without a material, and decodes the images that are
// used, each once. Wedges get the texture coordinates of the base colour, where there is none those of the first
// texture; and the next set that a texture is on. Textures that cannot go with these, or whose image cannot be had, are
// left out, and a warning says so.
// Throws GltfFault where there are too many.
GltfMaterials read_gltf_materials(const SourceFile& file, const ReadOptions& options, const tinygltf::Model& model,
                                  const GltfNotRead& not_read, TriMesh& mesh, ReadReport& report);

// Takes off the mesh the images of materials that it has nothing of.
void drop_unused_images(TriMesh& mesh);

}  // namespace lodestone
