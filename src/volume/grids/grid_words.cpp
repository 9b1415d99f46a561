#include "volume/grids/grid_words.h"

#include <algorithm>
#include <bit>
#include <glm/matrix.hpp>
#include <string>

#include "shaders/shared/volume.h"

namespace lodestone::volume {

namespace {

constexpr uint64_t words_per_block = DensityGrid::per_block / 2;

}  // namespace

GridWords::GridWords(const std::vector<Emitter>& emitters) {
    for (const Emitter& e : emitters) {
        if (!e.grid) continue;
        auto at = std::ranges::find(shared_, e.grid, &Shared::grid);
        if (at == shared_.end()) {
            at = shared_.insert(at, {e.grid, indices_, blocks_});
            indices_ += e.grid->index.size();
            blocks_ += e.grid->block_count();
        }
        placed_.push_back({static_cast<size_t>(at - shared_.begin()), voxel_to_world(e)});
    }
}

Result<void> GridWords::fit(uint64_t most_bytes) const {
    const auto wrong = [&](const std::string& what, uint64_t bytes) {
        return fail(Fault::format, "volumes: " + what + " of all grids take " + std::to_string(bytes >> 20) +
                                       " MiB; the limit is " + std::to_string(most_bytes >> 20) +
                                       "; take coarser grids, or fewer");
    };
    if (4 * index_count() > most_bytes) return wrong("boxes", 4 * index_count());
    if (4 * value_count() > most_bytes) return wrong("values", 4 * value_count());
    return {};
}

uint64_t GridWords::placed_count() const { return std::max<uint64_t>(placed_.size(), 1) * 4 * LODE_GRID_TEXELS; }
uint64_t GridWords::index_count() const { return std::max<uint64_t>(indices_, 1); }
uint64_t GridWords::value_count() const { return std::max<uint64_t>(words_per_block * blocks_, 1); }

std::vector<uint32_t> GridWords::placed(const Lattice& lattice) const {
    std::vector<uint32_t> words;
    for (const Placed& p : placed_) {
        const Shared& shared = shared_[p.shared];
        const glm::mat4 to_voxel = glm::inverse(lattice.world_to_lattice() * p.voxel_to_world);
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 4; ++column) words.push_back(std::bit_cast<uint32_t>(to_voxel[column][row]));
        }
        const glm::uvec3& blocks = shared.grid->blocks;
        words.insert(words.end(), {blocks.x, blocks.y, blocks.z, std::bit_cast<uint32_t>(shared.grid->most),
                                   static_cast<uint32_t>(shared.first_index), 0, 0, 0});
    }
    return words;
}

std::vector<uint32_t> GridWords::index() const {
    std::vector<uint32_t> words;
    for (const Shared& shared : shared_) {
        for (const uint32_t block : shared.grid->index)
            words.push_back(block == DensityGrid::no_block ? LODE_NO_BRICK
                                                           : static_cast<uint32_t>(shared.first_block + block));
    }
    return words;
}

std::vector<uint32_t> GridWords::values() const {
    std::vector<uint32_t> words;
    for (const Shared& shared : shared_) {
        const std::vector<uint16_t>& shares = shared.grid->shares;
        for (size_t k = 0; k < shares.size(); k += 2) words.push_back(shares[k] | uint32_t{shares[k + 1]} << 16);
    }
    return words;
}

}  // namespace lodestone::volume
