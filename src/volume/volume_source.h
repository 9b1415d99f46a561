// Volumes as an effect: smoke and fire made of metavoxels, beside any backend. It fills bricks with what particles are
// at a time, lets the light through them, and marches rays through them (docs/volumes.md).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/result.h"
#include "frame/frame_source.h"
#include "volume/binning.h"
#include "volume/grids/grid_words.h"
#include "volume/lattice.h"
#include "volume/particles.h"
#include "volume/quality.h"
#include "volume/volume_recipe.h"

namespace lodestone::volume {

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
    // Fault::machine where the pool cannot hold a few bricks, Fault::format where grids are too large together.
    // emitters: at least one.
    static Result<std::unique_ptr<VolumeSource>> open(std::vector<Emitter> emitters, const VolumeOptions& options);

    const Recipe& recipe() const override { return buffers_.recipe(); }
    // Without commands where there is nothing to be seen and nothing to shadow. Of the statistics: resident_bytes,
    // uploaded_bytes; of the others `bricks`, `metavoxels` (of the lattice), `brick_bytes`, `across` (metavoxels along
    // its longest side, fewer than asked for where the pool is too small) and `filled` (bricks that this frame fills).
    Plan plan(const FrameInput& input) override;
    Result<void> validate() const override;

    Quality quality;  // of the frames to come

    const Lattice& lattice() const { return lattice_; }  // of the last plan
    const Bins& bins() const { return shown_.bins; }     // of what is seen
    // Where Recipe::buffers has the result: two words a pixel, half floats of red, green, blue and what shines through.
    uint32_t result_buffer() const;
    // The pixels of which it does, in the last plan: the first in x and y, and past the last; the others have nothing.
    // No pixels where rays are not marched.
    const glm::uvec4& marched() const { return marched_; }

private:
    // Metavoxels at a time, and where the pool has them.
    struct Bricks {
        Bins bins;
        uint32_t first_slot = 0;  // of the first brick; the others follow
        uint32_t half = 0;        // of the table and of the scales
        float most_density = 1;   // that a voxel can hold, per world unit
        uint32_t filled = 0;      // bricks whose voxels are there
        uint32_t halos = 0;       // bricks whose halo is there
        uint32_t end() const { return first_slot + static_cast<uint32_t>(bins.bricks.size()); }
    };

    VolumeSource(std::vector<Emitter> emitters, const VolumeOptions& options);

    void renew_lattice(const glm::vec3& light);
    uint32_t slots() const;
    std::vector<Particle> seen_particles(double time) const;
    Bricks bricks_at(Plan& plan, double time, std::vector<Particle>& particles);
    void coarsen(Plan& plan, const std::vector<Particle>& particles);
    void upload_bricks(Plan& plan, const Bricks& bricks, const std::vector<Particle>& particles);

    void fill(Plan& plan, const FrameInput& input);
    void fill_all(Plan& plan, double time);
    void begin_round(Plan& plan, const FrameInput& input);
    void continue_round(Plan& plan);
    void dispatch_fill(Plan& plan, Bricks& bricks, uint32_t end, bool begins);
    void clear_columns(Plan& plan, const Bins& bins);

    glm::uvec4 pixels_of_bricks(const View& view) const;
    void march(Plan& plan, const View& view);
    void march_by_metavoxel(Plan& plan, const View& view);
    void upload_constants(Plan& plan, const View& view);

    std::vector<Emitter> emitters_;
    GridWords grids_;  // of the emitters
    VolumeOptions options_;
    VolumeBuffers buffers_;
    uint32_t across_ = 0;  // metavoxels, now
    // What the lattice was made for; 0: there is none yet.
    glm::vec3 light_{0};
    uint32_t lattice_across_ = 0;
    Lattice lattice_;
    glm::uvec3 light_places_{0};
    uint32_t light_spacing_ = 1, light_step_ = 8;  // voxels
    std::vector<uint8_t> columns_;  // of metavoxels, y by y: what the light grid has of them is not all of the light
    Bricks shown_, next_;           // next_: of the round under way
    bool filled_ = false, by_metavoxel_ = false;
    uint32_t since_filled_ = 0;  // frames
    std::vector<uint32_t>
        shares_;  // bricks that are filled when each frame of the round under way is done; none: there is no round
    size_t round_ = 0;  // frames of it that are done
    double time_ = 0;   // of the frame before
    glm::uvec4 marched_{0};
    uint32_t filled_now_ = 0;  // bricks that this frame fills
    bool statics_sent_ = false, warned_size_ = false, warned_crowd_ = false, warned_room_ = false;
};

}  // namespace lodestone::volume
