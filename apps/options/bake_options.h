// The options that say what an asset becomes, for the subcommands that bake: its bytes depend on them.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "apps/scene/bake.h"

namespace lodestone {

// What they are given as, before it is known whether it makes sense.
struct BakeWords {
    std::string backends = "lod", orders = "keyframe,static,classic", cache = "fifo16";
    uint32_t clusters = 0, resolution = 0, attribute_resolution = 0;  // 0: as the mesh asks for
    bool no_leaves = false, keep_uv = false;
    std::string texture_quality = std::to_string(usual_texture_quality);  // or "lossless"
    BakeOptions bake;                                                     // the rest
};

// Adds them to a command; `words` must outlive it. Help lists them in the order in which they are added.
void add_bake_options(CLI::App& command, BakeWords& words);

// Those of height maps alone.
void add_height_options(CLI::App& command, ReadOptions& read);

// What the given words and numbers ask of a bake; Fault::usage where they make no sense.
Result<BakeOptions> bake_options_of(const BakeWords& words);

}  // namespace lodestone
