// A small picture of a mesh, drawn without a device: for lists of many.
#pragma once

#include "mesh/tri_mesh.h"

namespace lodestone {

// The mesh seen from above a corner of its box, lit from the front, in grey; transparent where it is not. The same
// texels on every machine.
Image thumbnail_of(const TriMesh& mesh, uint32_t width = 96, uint32_t height = 72);

}  // namespace lodestone
