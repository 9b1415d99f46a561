// Writes meshes: PLY (binary little endian), OBJ with its .mtl, GLB. The file appears whole or not at all.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "mesh/tri_mesh.h"

namespace lodestone {

// Chooses the format by extension: .ply, .obj, .glb; anything else is Fault::usage. Triangles and vertices keep their
// order. PLY writes one vertex per wedge (seams become duplicated positions, bit for bit equal); OBJ keeps positions
// shared; GLB writes one primitive per material with images embedded as PNG.
Result<void> write_mesh(const TriMesh& mesh, const std::filesystem::path& path);

}  // namespace lodestone
