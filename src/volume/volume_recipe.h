// What the effect needs of the renderer: its buffers and pipelines, and the words that looks and particles
// become.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "frame/plan.h"
#include "frame/recipe.h"
#include "volume/grids/grid_words.h"
#include "volume/lattice.h"
#include "volume/particles.h"

namespace lodestone::volume {

// Numbers into Recipe::pipelines. Buffers have the numbers of their bindings (shaders/shared/volume.h).
enum Pipeline : uint32_t {
    fill_pipeline,
    fill_alone_pipeline,  // the same, of bricks that fill their own halo
    halo_pipeline,
    no_light_pipeline,
    march_pipeline,
    upsample_pipeline,
    misfits_pipeline,
    by_metavoxel_pipeline,
    composite_pipeline
};
inline constexpr uint64_t most_block_bytes = uint64_t{1} << 27;  // of a buffer that is bound at once, on every device

// How large the buffers may get.
struct VolumeSizes {
    uint32_t across = 0, voxels = 0;  // most metavoxels across the lattice, voxels across a metavoxel
    uint32_t slots = 0;               // most bricks at a time
    uint64_t light_places = 0;        // of the light grid
};
// Bytes of a metavoxel's voxels with their halo.
uint64_t brick_bytes(uint32_t voxels);
// grids: those of the emitters.
Recipe recipe_of(const VolumeSizes& sizes, const std::vector<Emitter>& emitters, const GridWords& grids);

// A recipe whose buffers grow, and the commands of a plan that this takes.
class VolumeBuffers {
public:
    VolumeBuffers() = default;
    explicit VolumeBuffers(Recipe recipe) : recipe_(std::move(recipe)) {}

    const Recipe& recipe() const { return recipe_; }
    const BufferSpec& operator[](uint32_t buffer) const { return recipe_.buffers[buffer]; }
    uint64_t bytes() const;  // of all buffers
    // Gives a buffer room for so many bytes. kept: bytes that stay as they are where it grows.
    void make_room(Plan& plan, uint32_t buffer, uint64_t bytes, uint64_t kept = 0);
    // Writes words from a byte on, and makes room for them; what lies before stays.
    void upload(Plan& plan, uint32_t buffer, std::vector<uint32_t> words, uint64_t offset = 0);

private:
    Recipe recipe_;
};

// Texels of four words: four a look, then their tables.
std::vector<uint32_t> words_of_looks(const std::vector<Emitter>& emitters);
// Three texels of four words each, in lattice space.
std::vector<uint32_t> words_of_particles(const std::vector<Particle>& particles, const Lattice& lattice);
// The most that a particle's density may be, per world unit; 0: it has none.
float most_density_of(const Emitter& emitter);
// The most that a voxel can hold: eight times the densest particle's. Where more overlap than that, nothing is seen
// through a voxel anyway.
float most_density_of(const std::vector<Emitter>& emitters);
// The most that any look sends out.
float most_emission_of(const std::vector<Emitter>& emitters);

}  // namespace lodestone::volume
