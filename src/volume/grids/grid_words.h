// Density grids as shaders read them (shaders/volume/grid.glsl): each grid once, and each place where one stands.
#pragma once

#include <cstdint>
#include <vector>

#include "base/result.h"
#include "volume/lattice.h"
#include "volume/particles.h"

namespace lodestone::volume {

// Which grids emitters have, each named once however many emitters stand it somewhere.
class GridWords {
public:
    explicit GridWords(const std::vector<Emitter>& emitters);
    bool empty() const { return placed_.empty(); }
    // Fault::format where index or values do not fit into a buffer of so many bytes.
    Result<void> fit(uint64_t most_bytes) const;

    // Words of the buffers, at least one each.
    uint64_t placed_count() const;  // LODE_VOLUME_GRIDS
    uint64_t index_count() const;
    uint64_t value_count() const;
    std::vector<uint32_t> placed(const Lattice& lattice) const;
    std::vector<uint32_t> index() const;
    std::vector<uint32_t> values() const;

private:
    struct Shared {
        std::shared_ptr<const DensityGrid> grid;
        uint64_t first_index = 0, first_block = 0;
    };
    struct Placed {
        size_t shared = 0;
        glm::mat4 voxel_to_world{1};
    };
    std::vector<Shared> shared_;
    std::vector<Placed> placed_;  // by emitter, of those that have a grid
    uint64_t indices_ = 0, blocks_ = 0;
};

}  // namespace lodestone::volume
