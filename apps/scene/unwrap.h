// A mesh with new texture coordinates and, where that is asked for, its textures in them.
#pragma once

#include <cstdint>

#include "base/json.h"
#include "base/progress.h"
#include "base/result.h"
#include "mesh/tri_mesh.h"
#include "vgi/unwrap/unwrap.h"

namespace lodestone {

// What is to be made, in texels.
struct UnwrapChoices {
    vgi::UnwrapOptions squares;  // its gutter is of no use: it follows from the members below
    uint32_t resolution = 4096;  // texels along a side of a square, 16 .. 16384
    double gutter = 4;           // texels between charts, at least
    bool bake = false;           // colours and textures of the materials are brought over
};

// What was made.
struct UnwrapDone {
    vgi::Unwrapped unwrapped;
    vgi::UnwrapReport report;
    double bake_seconds = 0;  // of textures
};

// mesh: repaired. Warns where textures are left out. Errors as those of vgi::unwrap.
Result<UnwrapDone> unwrap_mesh(const TriMesh& mesh, const UnwrapChoices& choices, const Progress& progress);

// Lays the textures of a mesh out anew: in one square, as large as they are, cut as seldom as can be. mesh: repaired,
// with textures; so it stays. Errors as those of vgi::unwrap.
Result<vgi::UnwrapReport> retexture(TriMesh& mesh, const Progress& progress);

// What `unwrap --json` tells of the mesh and of what was asked for: all but times and memory.
Json unwrap_report(const vgi::UnwrapReport& report, const UnwrapChoices& choices);

}  // namespace lodestone
