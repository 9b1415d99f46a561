// Volumes of a scene: what is read of them.
#pragma once

#include <vector>

#include "apps/scene/scene_node.h"
#include "volume/volume_source.h"

namespace lodestone {

struct SceneVolumes {
    std::vector<volume::Emitter> emitters;  // of all volumes; empty where there are none
    volume::VolumeOptions options;
    volume::Quality quality;
};
inline constexpr uint64_t most_particles = 65536;  // of all volumes of a scene together

// The members `volumes` and `volume_options` of a scene (docs/scenes.md). Fault::format names what is wrong.
Result<void> read_volumes(const Node& root, SceneVolumes& into);

}  // namespace lodestone
