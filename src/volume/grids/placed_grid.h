// A density grid where it stands in the world, and which parts of a lattice it may reach.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <memory>

#include "volume/grids/density_grid.h"
#include "volume/lattice.h"

namespace lodestone::volume {

struct PlacedGrid {
    std::shared_ptr<const DensityGrid> grid;
    glm::mat4 voxel_to_world{1};  // affine
};

// Whether boxes of a lattice may hold something of the grid. It says no only where every place of the box samples 0.
//   Gottschalk, Lin, Manocha, "OBBTree", SIGGRAPH 1996, for axes that separate boxes; here those of their faces.
class GridReach {
public:
    GridReach(const PlacedGrid& placed, const Lattice& lattice);
    // low, high: of a box in lattice space.
    bool meets(const glm::vec3& low, const glm::vec3& high) const;

private:
    const DensityGrid* grid_;
    glm::mat4 to_voxel_, to_lattice_;     // from lattice space, and back
    glm::vec3 low_, high_;                // voxel space: outside of it all is 0
    glm::vec3 half_block_, half_around_;  // half sides in lattice space of a block and what it reaches, and of its box
};

}  // namespace lodestone::volume
