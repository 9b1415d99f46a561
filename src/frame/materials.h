// The materials of a scene: one table that every backend's vertices refer to by number.
#pragma once

#include <algorithm>
#include <vector>

#include "base/looks/material.h"

namespace lodestone {

// The materials and images of a scene.
struct MaterialSet {
    std::vector<Material> materials;  // at least one
    std::vector<Image> images;        // that their textures refer to, of any size
    // Whether instances may be mirrored. Where it is not told, what has one side is shown from behind as long as one
    // is.
    bool mirrors = false;

    // Whether a surface is shown from behind, so that views are not to leave out what faces away.
    bool any_double_sided() const {
        return std::ranges::any_of(materials, [](const Material& m) { return m.double_sided; });
    }
};

}  // namespace lodestone
