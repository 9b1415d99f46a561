// The order in which metavoxels can be drawn one by one as soon as light has come through them.
//
//   "Sparse procedural volumetric rendering" (Intel, in GPU Pro 6), section on sorting: light goes from layer to layer.
//   Layers between the light and the eye come nearer to the eye on the way, and are laid over what is there; those past
//   it go away, and are laid under it.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "volume/binning.h"
#include "volume/lattice.h"

namespace lodestone::volume {

// A brick to draw, and how.
struct EyeOrdered {
    uint32_t brick = 0;  // into Bins::bricks
    bool under = false;  // what is there already stands before it; else it stands before that
    bool operator==(const EyeOrdered&) const = default;
};

// All bricks, layer after layer as the light meets them; within a layer far to near where they are laid over, near to
// far where they are laid under. eye: lattice space, anywhere.
std::vector<EyeOrdered> eye_order(const Lattice& lattice, const Bins& bins, const glm::vec3& eye);

}  // namespace lodestone::volume
