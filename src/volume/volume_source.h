// Volumes as an effect: smoke and fire made of metavoxels, beside any backend. It fills bricks with what particles are
// at a time, lets the light through them, and marches rays through them (docs/volumes.md).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/result.h"
#include "frame/frame_source.h"
#include "volume/binning.h"
#include "volume/lattice.h"
#include "volume/particles.h"

namespace lodestone::volume {

// How voxels take light away.
enum class Absorption : uint8_t {
    exponential,  // e^-(density * length), whatever the steps are
    rational,     // 1 / (1 + density * length) a step, as in the source: depends on how many steps there are
};

// What can change from frame to frame.
struct Quality {
    float steps = 1;       // samples a voxel, in the middle of the picture; 0.125 .. 4
    uint32_t divisor = 1;  // pixels of the picture, a side, that one of the target stands for; 1 .. 4
    uint32_t refresh = 1;  // voxels are filled every so many frames; 0: once
    float density = 1;     // factor of all densities, 0 .. 100
    Absorption absorption = Absorption::exponential;
    bool skips_empty = true;  // false: samples are taken of empty places, too; for measurements
    bool operator==(const Quality&) const = default;
};

// What is fixed.
struct VolumeOptions {
    uint32_t metavoxels = 32;                   // across the longest side of the lattice, 1 .. 64
    uint32_t voxels = 32;                       // across a metavoxel, 8 .. 32
    uint64_t pool_bytes = uint64_t{256} << 20;  // that bricks may take; a scene that needs more gets coarser
    float forward = 0.5f;                       // share of scattered light that goes on as it went: what lights and
                                                // shadows by it takes its colour, 0 .. 0.95
    bool operator==(const VolumeOptions&) const = default;
};

// The effect. One lattice holds everything that all emitters send out, so volumes may overlap and shadow each other.
class VolumeSource final : public FrameSource {
public:
    // Fault::machine where the pool cannot hold a few bricks.
    // emitters: at least one.
    static Result<std::unique_ptr<VolumeSource>> open(std::vector<Emitter> emitters, const VolumeOptions& options);

    const Recipe& recipe() const override { return recipe_; }
    // Without commands where there is nothing to be seen and nothing to shadow. Of the statistics: resident_bytes,
    // uploaded_bytes; of the others `bricks`, `metavoxels` (of the lattice), `brick_bytes`, `across` (metavoxels along
    // its longest side, fewer than asked for where the pool is too small) and `filled` (1 where this frame fills
    // bricks).
    Plan plan(const FrameInput& input) override;
    Result<void> validate() const override;

    Quality quality;  // of the frames to come

    const Lattice& lattice() const { return lattice_; }  // of the last plan
    const Bins& bins() const { return bins_; }           // of the last that filled
    // Where Recipe::buffers has the result: two words a pixel, half floats of red, green, blue and what shines through.
    uint32_t result_buffer() const;

private:
    VolumeSource(std::vector<Emitter> emitters, const VolumeOptions& options);

    bool renew_lattice(const glm::vec3& light);
    void fill(Plan& plan, const FrameInput& input);
    void upload_bins(Plan& plan, const std::vector<Particle>& particles);
    void dispatch_fill(Plan& plan, bool columns_emptied);
    void march(Plan& plan, const View& view);
    void upload_constants(Plan& plan, const View& view);
    void make_room(Plan& plan, uint32_t buffer, uint64_t bytes);
    void upload(Plan& plan, uint32_t buffer, std::vector<uint32_t> words);
    void coarsen(Plan& plan, const std::vector<Particle>& particles);
    std::vector<Particle> seen_particles(double time) const;

    std::vector<Emitter> emitters_;
    VolumeOptions options_;
    Recipe recipe_;
    uint32_t across_ = 0;  // metavoxels, now
    glm::vec3 light_{0};   // that the lattice was made for
    Lattice lattice_;
    glm::uvec3 light_places_{0};
    uint32_t light_spacing_ = 1, light_step_ = 8;  // voxels
    Bins bins_;
    std::vector<uint8_t> columns_;  // of metavoxels, y by y: what the light grid has of them is not all of the light
    bool filled_ = false, statics_sent_ = false, warned_size_ = false, warned_crowd_ = false;
    uint64_t filled_frame_ = 0;
    float filled_density_ = 1;  // Quality::density of what the bricks hold
};

}  // namespace lodestone::volume
