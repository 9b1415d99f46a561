// The materials of a scene: one table that every backend's vertices refer to by number.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "base/looks/environment.h"
#include "base/looks/material.h"

namespace lodestone {

// The materials and images of a scene, and what lights them from all around.
struct MaterialSet {
    std::vector<Material> materials;  // at least one
    std::vector<Image> images;        // that their textures refer to, of any size
    // Whether instances may be mirrored. Where it is not told, what has one side is shown from behind as long as one
    // is.
    bool mirrors = false;
    // Light from all around in place of a sky and a ground of one colour each; null where there is none.
    std::shared_ptr<const Environment> environment{};

    // Whether a surface is shown from behind, so that views are not to leave out what faces away.
    bool any_double_sided() const {
        return std::ranges::any_of(materials, [](const Material& m) { return m.double_sided; });
    }
};

}  // namespace lodestone
