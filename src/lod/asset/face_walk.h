// An order of faces as a walk over the surface: each face by where it lies from those before it. Orders made for a
// vertex cache mostly go on to a neighbour of the last face, or to one of a face not far behind.
#pragma once

#include <cstdint>
#include <vector>

#include "lod/asset/number_streams.h"
#include "lod/asset/split_mesh.h"

namespace lodestone {

// Codes a permutation of all faces of the mesh as it is.
// order: given where Io (NumberWriter or NumberReader) writes, filled where it reads. False where what is read is no
// permutation.
template <class Io>
bool code_walk(Io& io, const SplitMesh& mesh, std::vector<uint32_t>& order);

extern template bool code_walk(NumberWriter&, const SplitMesh&, std::vector<uint32_t>&);
extern template bool code_walk(NumberReader&, const SplitMesh&, std::vector<uint32_t>&);

}  // namespace lodestone
