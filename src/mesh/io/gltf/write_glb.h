// The writer of binary glTF 2.0.
#pragma once

#include <filesystem>
#include <vector>

#include "mesh/io/write.h"

namespace lodestone {

// One buffer, one node, one primitive per material over shared vertices, images embedded. Triangles and vertices keep
// their order; meshopt may begin a triangle at another corner.
Result<void> write_glb(const TriMesh& mesh, const std::filesystem::path& path, const WriteOptions& options);

// A texture as it is written.
Result<std::vector<std::byte>> encoded_texture(const Image& image, const WriteOptions& options);
// What the names of such files end with: ".png".
const char* extension_of(WriteOptions::Textures format);

}  // namespace lodestone
