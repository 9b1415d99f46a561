// Density grids that volumes of a scene name.
#pragma once

#include "apps/scene/scene_volumes.h"

namespace lodestone {

// Reads the grids' files, each once, and gives them to their emitters; `grids` is empty then. Errors as of
// volume::read_vdb.
Result<void> read_grids(SceneVolumes& volumes);

}  // namespace lodestone
