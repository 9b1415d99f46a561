// The backend `lod`: progressive meshes at run time. Each instance asks for the coarsest level whose error stays under
// the pixel error; a limited number of cursors per asset, each with its own part of one index buffer, serves all
// instances.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "frame/frame_source.h"
#include "lod/asset/progressive_mesh.h"

namespace lodestone {

// How progressive meshes are drawn.
struct LodOptions {
    std::string order = {};                       // face order to draw; empty: the asset's first
    uint64_t resident_bytes = uint64_t{1} << 30;  // for vertex and index buffers of all assets together
    uint32_t instances = 1;  // most instances of one asset in the scene: more cursors than that are never made
    // A level stays while its error is between this share and all of what is allowed, so that views that tremble change
    // nothing, and leaves that range only as far as it must. 1: the coarsest level that is allowed.
    double steady_share = 0.9;
    // Vertices are on their way to their parents before they go, so that nothing pops.
    bool geomorph = false;
    // Wedges on their way, as a share of those of the level that is morphed to; > 0. More of them go slower, and are
    // more to draw.
    double morphing_share = 1.0 / 3;
};

// A backend that draws the assets, at least one.
//
// Cursors. Where memory allows, every instance has its own. Otherwise an asset's cursors are of falling size: the
// finest serves every level, the next only levels of at most 1/2^(1/m) of its slots, and so on, m as large as the
// budget allows, and as lets them reach down to 256 slots; all together stay below a fixed multiple of one index buffer
// however many instances there are. An instance uses the smallest cursor that can hold what it asks for, at the finest
// level any of that cursor's instances asks for: never coarser than asked, and at most 2^(1/m) times the slots. Where
// not even one full index buffer fits, the finest levels are out of reach, and stats "levels_out_of_reach" counts the
// instances that had to be coarser.
//
// Geomorphs. The level that errors ask for is what is morphed to; drawn is the level with a third more wedges, and
// those more are the further on their way to their parents the sooner they go. A parent may be on its way, too. When
// the level moves on by one, every one of them moves on by one part in their number.
//
// Fault::machine where the vertices alone exceed the budget; Fault::usage where an asset lacks the order.
Result<std::unique_ptr<FrameSource>> open_lod(const std::vector<std::shared_ptr<const ProgressiveMesh>>& assets,
                                              const LodOptions& options);

}  // namespace lodestone
