// Puts what a glTF file has compressed in the place of what it says: KHR_draco_mesh_compression and
// EXT_meshopt_compression.
#pragma once

#include <tiny_gltf.h>

#include <functional>
#include <set>
#include <string>
#include <string_view>

#include "mesh/limits.h"

namespace lodestone {

// Buffers that only stand in for compressed ones (`fallback`) may hold nothing, or be in a file that need not be there
// where all their views are compressed; and accessors of what Draco compressed may have no buffer view, which tinygltf
// refuses. The same document, in which each such buffer is there, of one byte, and each such accessor has the view of
// its compressed mesh; empty where the document needs no change or is none.
// json: of .gltf or of GLB.
std::string with_stand_ins(std::string_view json);

// Unpacks buffer views, and the primitives of these meshes. The model has more buffers, views and accessors then, to
// which the primitives refer. A view is decoded once, however many primitives have it. warn: takes a line where a file
// brings what is not compressed, too, and that is taken. Throws GltfFault.
void unpack_gltf(tinygltf::Model& model, const std::set<int>& meshes, const Limits& limits,
                 const std::function<void(const std::string&)>& warn);

}  // namespace lodestone
