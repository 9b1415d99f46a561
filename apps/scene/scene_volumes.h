// Volumes of a scene: what is read of them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/scene/scene_node.h"
#include "volume/volume_source.h"

namespace lodestone {

// A density grid that a volume names. Its file is read where it is drawn (apps/drawing/grids.h).
struct SceneGrid {
    std::filesystem::path file;
    std::string name;             // in the file; "" for `density`, or the first
    size_t first = 0, count = 0;  // emitters that it stands for
    bool operator==(const SceneGrid&) const = default;
};

struct SceneVolumes {
    std::vector<volume::Emitter> emitters;  // of all volumes; empty where there are none
    std::vector<SceneGrid> grids;           // not read yet: their emitters have none
    volume::VolumeOptions options;
    volume::Quality quality;
};
inline constexpr uint64_t most_particles = 65536;  // of all volumes of a scene together

// The members `volumes` and `volume_options` of a scene (docs/scenes.md). Fault::format names what is wrong.
Result<void> read_volumes(const Node& root, const Beside& beside, SceneVolumes& into);

// Draws volumes as a word says: `on`, as they are; `reference`, metavoxel by metavoxel; or a level of quality by its
// number. option: what the word was given as, for the error; Fault::usage where it is none of these.
Result<void> choose_volumes(const std::string& option, const std::string& word, volume::Quality& quality);

}  // namespace lodestone
