// The vgi part of a bake.
#pragma once

#include "apps/scene/bake.h"
#include "base/json.h"
#include "vgi/asset/atlas.h"

namespace lodestone {

// The atlas with its errors; figures go into `report` (the `vgi` object of docs/cli.md, but for `bytes`).
Result<vgi::Atlas> bake_atlas(const TriMesh& mesh, const BakeOptions& options, Json& report, const Progress& progress,
                              const CheckpointFolder* work);

}  // namespace lodestone
