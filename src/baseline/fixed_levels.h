// The baselines at run time: meshes with a fixed set of levels, each its own index buffer over shared vertices, chosen
// per instance by the same projection of the same kind of error as the backends. `full` is the case of one level.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "frame/frame_source.h"
#include "shaders/shared/mesh_vertex.h"

namespace lodestone {

// One mesh of an asset.
struct FixedLevel {
    std::span<const uint32_t> indices;  // three per triangle
    double error = 0;                   // object units; never decreases from level to level
};

// An asset: all its meshes.
struct FixedLevels {
    std::span<const MeshVertex> vertices;        // of all levels
    std::span<const FurtherAttributes> further;  // none, or as many as vertices
    std::vector<FixedLevel> levels;     // finest first, at least one; the finest is drawn where none is good enough
    std::shared_ptr<const void> owner;  // keeps what the spans refer to
};

// A backend that draws the assets, at least one. They are kept and uploaded with the first plan.
// Fault::machine where the assets exceed resident_bytes.
Result<std::unique_ptr<FrameSource>> open_fixed_levels(std::vector<FixedLevels> assets, uint64_t resident_bytes);

}  // namespace lodestone
