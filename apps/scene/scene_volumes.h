// Volumes of a scene: what is read of them.
#pragma once

#include <string>
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

// Draws volumes as a word says: `on`, as they are; `reference`, metavoxel by metavoxel; or a level of quality by its
// number. option: what the word was given as, for the error; Fault::usage where it is none of these.
Result<void> choose_volumes(const std::string& option, const std::string& word, volume::Quality& quality);

}  // namespace lodestone
