#include "volume/volume_source.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "base/check.h"
#include "shaders/shared/light_grid.h"
#include "shaders/shared/volume.h"
#include "volume/eye_order.h"
#include "volume/noise_cube.h"

namespace lodestone::volume {

namespace {

constexpr uint64_t most_light_places = uint64_t{1} << 22;
constexpr uint32_t fewest_bricks = 8;  // that a pool must hold
constexpr uint32_t work_of_block = 2;  // what a block takes beside its particles, in particles
constexpr double longest_step = 1;     // seconds from frame to frame after which a round does not look ahead

// How far apart places of the light grid are, in voxels: across the light, along it.
constexpr std::pair<uint32_t, uint32_t> light_spacings[] = {{1, 4},  {1, 8},  {2, 8},  {2, 16},
                                                            {4, 16}, {4, 32}, {8, 32}, {16, 64}};
struct LightGrid {
    glm::uvec3 places{0};
    uint32_t across = 1, along = 8;
};
LightGrid light_grid_of(const glm::uvec3& voxels) {
    LightGrid grid;
    for (const auto& [across, along] : light_spacings) {
        grid = {(voxels + glm::uvec3(across - 1, across - 1, along - 1)) / glm::uvec3(across, across, along), across,
                along};
        if (uint64_t{grid.places.x} * grid.places.y * grid.places.z <= most_light_places) break;
    }
    return grid;
}

void dispatch(Plan& plan, Pipeline pipeline, const std::array<uint32_t, 3>& groups, const Words& words = {}) {
    Dispatch command;
    command.pipeline = pipeline;
    command.groups = groups;
    command.words = words;
    plan.commands.push_back({Stage::effect, command});
}

// A work group's rows for each of `count` bricks, from number `first` on.
void dispatch_bricks(Plan& plan, Pipeline pipeline, uint32_t rows, uint32_t first, uint32_t count, Words words = {}) {
    for (uint32_t done = 0; done < count; done += most_groups) {
        words[0] = first + done;
        dispatch(plan, pipeline, {rows, std::min(count - done, most_groups), 1}, words);
    }
}

// Calls visit(begin, end) for the bricks of each layer that lie in begin .. end.
template <class Visit>
void for_each_layer(const Bins& bins, uint32_t begin, uint32_t end, Visit&& visit) {
    for (size_t layer = 0; layer + 1 < bins.first_brick.size(); ++layer) {
        const uint32_t from = std::max(bins.first_brick[layer], begin);
        const uint32_t to = std::min(bins.first_brick[layer + 1], end);
        if (from < to) visit(from, to);
    }
}

// Where each of so many shares of bricks ends that are equally much work.
std::vector<uint32_t> shares_of(const Bins& bins, uint32_t frames) {
    const size_t blocks = bins.particle_count.size() / bins.bricks.size();
    std::vector<uint64_t> until;  // what the bricks up to each take, in particles that a block has
    uint64_t all = 0;
    for (size_t k = 0; k < bins.particle_count.size(); ++k) {
        all += work_of_block + bins.particle_count[k];
        if (k % blocks + 1 == blocks) until.push_back(all);
    }
    std::vector<uint32_t> ends;
    for (uint64_t frame = 1; frame <= frames; ++frame) {
        const auto last = std::ranges::lower_bound(until, all * frame / frames);
        ends.push_back(static_cast<uint32_t>(last - until.begin()) + 1);
    }
    return ends;
}

uint32_t groups_of(uint32_t pixels) { return (pixels + 7) / 8; }

VolumeSizes sizes_of(const VolumeOptions& options) {
    const uint64_t across = options.metavoxels, side = across * options.voxels;
    VolumeSizes sizes;
    sizes.across = options.metavoxels;
    sizes.voxels = options.voxels;
    sizes.slots =
        static_cast<uint32_t>(std::min(options.pool_bytes / brick_bytes(options.voxels), across * across * across));
    // No lattice has more places than a cube, as close together as they ever are.
    sizes.light_places = std::min(side * side * ((side + 3) / 4), most_light_places);
    return sizes;
}

}  // namespace

Result<std::unique_ptr<VolumeSource>> VolumeSource::open(std::vector<Emitter> emitters, const VolumeOptions& options) {
    LODE_CHECK(!emitters.empty());
    std::unique_ptr<VolumeSource> source(new VolumeSource(std::move(emitters), options));
    const uint64_t least = fewest_bricks * brick_bytes(options.voxels);
    if (options.pool_bytes < least) return over_budget("bricks of volumes", least, options.pool_bytes);
    if (auto fits = source->grids_.fit(most_block_bytes); !fits) return tl::unexpected(fits.error());
    return source;
}

VolumeSource::VolumeSource(std::vector<Emitter> emitters, const VolumeOptions& options)
    : emitters_(std::move(emitters)), grids_(emitters_), options_(options), across_(options.metavoxels) {
    LODE_CHECK(options.metavoxels >= 1 && options.metavoxels <= most_metavoxels, options.metavoxels);
    buffers_ = VolumeBuffers(recipe_of(sizes_of(options), emitters_, grids_));
}

uint32_t VolumeSource::result_buffer() const { return LODE_VOLUME_RESULT; }

// How many bricks there may be at a time.
uint32_t VolumeSource::slots() const {
    const BufferSpec& spec = buffers_[by_metavoxel_ ? LODE_VOLUME_BLOCKS : LODE_VOLUME_VOXELS];
    const uint32_t blocks =
        blocks_across(options_.voxels) * blocks_across(options_.voxels) * blocks_along(options_.voxels);
    return static_cast<uint32_t>(spec.most_bytes / spec.stride / (by_metavoxel_ ? blocks : 1));
}

// A lattice for the light, if it is another than before or coarser.
void VolumeSource::renew_lattice(const glm::vec3& light) {
    if (light == light_ && lattice_across_ == across_) return;
    light_ = light;
    lattice_across_ = across_;
    lattice_ = lattice_around(emitters_, light, across_, options_.voxels);
    const LightGrid grid = light_grid_of(lattice_.metavoxels * lattice_.voxels);
    light_places_ = grid.places;
    light_spacing_ = grid.across;
    light_step_ = grid.along;
    columns_.clear();
    filled_ = false;
}

// What is left out has no density, and costs nothing.
std::vector<Particle> VolumeSource::seen_particles(double time) const {
    std::vector<Particle> particles = particles_at(emitters_, time);
    std::erase_if(particles, [&](Particle& p) {
        p.density *= quality.density;
        return !(p.density * most_density_of(emitters_[p.emitter]) > 0);
    });
    return particles;
}

// Fewer metavoxels across, until there is room for those that are not empty. It stays so.
void VolumeSource::coarsen(Plan& plan, const std::vector<Particle>& particles) {
    const uint32_t asked = across_, first_needed = count_bricks(lattice_, particles);
    for (uint32_t needed = first_needed; needed > slots() && across_ > 1; needed = count_bricks(lattice_, particles)) {
        across_ = std::max(across_ * 7 / 8, 1U);
        renew_lattice(light_);
    }
    if (across_ == asked) return;
    plan.warnings.push_back(
        "volumes: " + std::to_string(first_needed) + " metavoxels are not empty and the pool holds " +
        std::to_string(slots()) + "; from now on there are " + std::to_string(across_) + " across in place of " +
        std::to_string(asked) + ". Raise pool_mib in the scene, or draw with --volumes reference, to have them finer");
}

// The bricks of a time, which nothing has been filled of. There may be none.
VolumeSource::Bricks VolumeSource::bricks_at(Plan& plan, double time, std::vector<Particle>& particles) {
    particles = seen_particles(time);
    coarsen(plan, particles);
    Bricks bricks;
    bricks.bins = bin_particles(lattice_, particles);
    bricks.most_density = most_density_of(emitters_) * std::max(quality.density, 1e-6f);
    if (bricks.bins.crowded && !std::exchange(warned_crowd_, true))
        plan.warnings.push_back("volumes: more than " + std::to_string(most_in_block) +
                                " particles meet in one place; those after them are left out there");
    return bricks;
}

void VolumeSource::upload_bricks(Plan& plan, const Bricks& bricks, const std::vector<Particle>& particles) {
    const Bins& bins = bricks.bins;
    std::vector<uint32_t> table(lattice_.metavoxel_count(), LODE_NO_BRICK), words, blocks;
    for (uint32_t b = 0; b < bins.bricks.size(); ++b) {
        const Brick& brick = bins.bricks[b];
        table[(brick.at.z * lattice_.metavoxels.y + brick.at.y) * lattice_.metavoxels.x + brick.at.x] =
            bricks.first_slot + b;
        words.push_back(brick.at.x | brick.at.y << 10 | brick.at.z << 20 | (brick.first ? 1U << 30 : 0) |
                        (brick.odd ? 1U << 31 : 0));
        words.push_back(brick.gap_before | brick.gap_after << 16);
        words.push_back(static_cast<uint32_t>(brick.occupied));
        words.push_back(static_cast<uint32_t>(brick.occupied >> 32));
    }
    for (size_t k = 0; k < bins.first_particle.size(); ++k) {
        blocks.push_back(bins.first_particle[k]);
        blocks.push_back(bins.particle_count[k]);
    }
    if (!std::exchange(statics_sent_, true)) {
        buffers_.upload(plan, LODE_VOLUME_LOOKS, words_of_looks(emitters_));
        buffers_.upload(plan, LODE_VOLUME_NOISE, make_noise_cube(1).words());
        if (!grids_.empty()) buffers_.upload(plan, LODE_VOLUME_GRID_INDEX, grids_.index());
        if (!grids_.empty()) buffers_.upload(plan, LODE_VOLUME_GRID_VALUES, grids_.values());
    }
    const uint64_t block_bytes = 4 * blocks.size() / bins.bricks.size();
    buffers_.upload(plan, LODE_VOLUME_TABLE, std::move(table), uint64_t{4} * bricks.half * lattice_.metavoxel_count());
    buffers_.upload(plan, LODE_VOLUME_BRICKS, std::move(words), uint64_t{16} * bricks.first_slot);
    buffers_.upload(plan, LODE_VOLUME_BLOCKS, std::move(blocks), block_bytes * bricks.first_slot);
    buffers_.upload(plan, LODE_VOLUME_LIST, bins.particles);
    buffers_.upload(plan, LODE_VOLUME_PARTICLES, words_of_particles(particles, lattice_));
    if (!grids_.empty()) buffers_.upload(plan, LODE_VOLUME_GRIDS, grids_.placed(lattice_));
    const glm::uvec3 side = lattice_.metavoxels * lattice_.voxels;
    buffers_.make_room(plan, LODE_VOLUME_FRONT, uint64_t{12} * side.x * side.y * (by_metavoxel_ ? 2 : 1));
}

// All of the light shines through columns that had bricks and have none.
void VolumeSource::clear_columns(Plan& plan, const Bins& bins) {
    const size_t columns = size_t{lattice_.metavoxels.x} * lattice_.metavoxels.y;
    bool emptied = columns_.size() != columns;
    columns_.resize(columns, 1);
    std::vector<uint8_t> now(columns, 0);
    for (const Brick& brick : bins.bricks) now[size_t{brick.at.y} * lattice_.metavoxels.x + brick.at.x] = 1;
    for (size_t c = 0; c < columns; ++c) emptied = emptied || (columns_[c] != 0 && now[c] == 0);
    columns_ = std::move(now);
    if (emptied) dispatch(plan, no_light_pipeline, {groups_of(light_places_.x), groups_of(light_places_.y), 1});
}

// Voxels of bricks up to `end`, and the halo of layers that are whole. begins: nothing was filled of them before this
// frame.
void VolumeSource::dispatch_fill(Plan& plan, Bricks& bricks, uint32_t end, bool begins) {
    const uint32_t tiles = blocks_across(lattice_.voxels) * blocks_across(lattice_.voxels);
    uint32_t whole = bricks.halos;
    for_each_layer(bricks.bins, bricks.filled, end, [&](uint32_t from, uint32_t to) {
        dispatch_bricks(plan, fill_pipeline, tiles, bricks.first_slot + from, to - from, {0, begins ? 1U : 0U});
    });
    filled_now_ += end - bricks.filled;
    bricks.filled = end;
    for (const uint32_t past : bricks.bins.first_brick) whole = past <= end ? std::max(whole, past) : whole;
    dispatch_bricks(plan, halo_pipeline, lattice_.voxels + 1, bricks.first_slot + bricks.halos, whole - bricks.halos);
    bricks.halos = whole;
}

// Bricks for what is there at this time, in place of those that are seen. shown_ may have none then.
void VolumeSource::fill_all(Plan& plan, double time) {
    shares_.clear();
    next_ = {};
    std::vector<Particle> particles;
    shown_ = bricks_at(plan, time, particles);
    if (shown_.bins.bricks.empty()) return;
    upload_bricks(plan, shown_, particles);
    clear_columns(plan, shown_.bins);
    filled_ = true;
    since_filled_ = 0;
    if (by_metavoxel_) return;
    buffers_.make_room(plan, LODE_VOLUME_VOXELS, uint64_t{shown_.end()} * lattice_.brick_words() * 4);
    dispatch_fill(plan, shown_, shown_.end(), true);
}

// Bricks beside those that are seen, for the time at which the round ends if frames go on as the last one came.
void VolumeSource::begin_round(Plan& plan, const FrameInput& input) {
    const double step = input.time - time_;
    const double ahead = step > 0 && step <= longest_step ? step * (quality.refresh - 1) : 0;
    std::vector<Particle> particles;
    next_ = bricks_at(plan, input.time + ahead, particles);
    const auto count = static_cast<uint32_t>(next_.bins.bricks.size());
    const bool below = count <= shown_.first_slot, room = below || uint64_t{shown_.end()} + count <= slots();
    if (!room && !std::exchange(warned_room_, true))
        plan.warnings.push_back("volumes: the pool has no room for a second set of " + std::to_string(count) +
                                " metavoxels, so they are not filled by and by. Raise pool_mib in the scene");
    // A lattice that has become coarser has nothing filled.
    if (count == 0 || !room || !filled_) {
        next_ = {};
        if (!filled_ || count == 0 || since_filled_ >= quality.refresh) fill_all(plan, input.time);
        return;
    }
    // Past those that are seen with some room, so that the round after fits before them.
    const uint32_t past = std::max(shown_.end(), std::min(count + count / 8, slots() - count));
    next_.first_slot = below ? 0 : past;
    next_.half = 1 - shown_.half;
    const uint64_t bytes = uint64_t{4} * lattice_.brick_words();
    buffers_.make_room(plan, LODE_VOLUME_VOXELS, bytes * next_.end(), bytes * shown_.end());
    upload_bricks(plan, next_, particles);
    shares_ = shares_of(next_.bins, quality.refresh);
    round_ = 0;
    continue_round(plan);
}

void VolumeSource::continue_round(Plan& plan) {
    dispatch_fill(plan, next_, shares_[round_], round_ == 0);
    if (++round_ < shares_.size()) return;
    clear_columns(plan, next_.bins);
    shown_ = std::exchange(next_, {});
    shares_.clear();
    since_filled_ = 0;
}

void VolumeSource::fill(Plan& plan, const FrameInput& input) {
    filled_now_ = 0;
    ++since_filled_;
    if (!filled_ || by_metavoxel_ || quality.refresh == 1) {
        fill_all(plan, input.time);
    } else if (!shares_.empty()) {
        continue_round(plan);
    } else if (quality.refresh > 1) {
        begin_round(plan, input);
    }
    time_ = input.time;
}

void VolumeSource::upload_constants(Plan& plan, const View& view) {
    gpu::VolumeConstants c{};
    c.world_to_lattice = lattice_.world_to_lattice();
    c.lattice_to_world = lattice_.lattice_to_world();
    c.metavoxels = glm::uvec4(lattice_.metavoxels, lattice_.voxels);
    c.light_places = glm::uvec4(light_places_, light_spacing_);
    const uint32_t d = quality.divisor;
    c.marched = marched_;
    c.picture = {view.width, view.height, (view.width + d - 1) / d, (view.height + d - 1) / d};
    c.voxel = lattice_.voxel;
    c.step_length = lattice_.voxel / quality.steps;
    c.far_plane = view.far_plane;
    c.near_plane = view.near_plane;
    const Bricks& filling = !shares_.empty() ? next_ : shown_;
    c.most_density = shown_.most_density;
    c.filled_most_density = filling.most_density;
    c.shown_half = shown_.half;
    c.filled_half = filling.half;
    c.emission = most_emission_of(emitters_);
    c.forward = options_.forward;
    c.divisor = d;
    c.absorption = quality.absorption == Absorption::exponential ? LODE_ABSORPTION_EXP : LODE_ABSORPTION_RATIONAL;
    c.light_step = light_step_;
    c.skips = quality.skips_empty ? 1 : 0;
    std::vector<uint32_t> words(sizeof c / 4);
    std::memcpy(words.data(), &c, sizeof c);
    buffers_.upload(plan, LODE_VOLUME_CONSTANTS, std::move(words));
}

// Pixels in which bricks that are seen may show, with a pixel of the target more around them.
glm::uvec4 VolumeSource::pixels_of_bricks(const View& view) const {
    glm::uvec3 low(~0U), high(0);
    for (const Brick& brick : shown_.bins.bricks) {
        low = glm::min(low, brick.at);
        high = glm::max(high, brick.at + 1U);
    }
    const glm::vec3 middle(lattice_.lattice_to_world() *
                           glm::vec4(0.5f * glm::vec3((low + high) * lattice_.voxels), 1));
    const float radius = 0.5f * lattice_.voxel * glm::length(glm::vec3((high - low) * lattice_.voxels));
    if (!frustum_of(view).touches(middle, radius)) return glm::uvec4(0);
    const glm::mat4 to_clip = view.world_to_clip() * lattice_.lattice_to_world();
    glm::vec2 least(1e9f), most(-1e9f);
    int behind = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::uvec3 at((corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y,
                            (corner & 4) != 0 ? high.z : low.z);
        const glm::vec4 clip = to_clip * glm::vec4(glm::vec3(at * lattice_.voxels), 1);
        behind += clip.w < view.near_plane ? 1 : 0;
        const glm::vec2 place = glm::vec2(clip) / std::max(clip.w, 1e-9f);
        least = glm::min(least, place);
        most = glm::max(most, place);
    }
    if (behind == 8) return glm::uvec4(0);
    const glm::uvec2 size(view.width, view.height);
    if (behind > 0) return glm::uvec4(0, 0, size);
    const auto d = static_cast<float>(quality.divisor);
    const auto pixels = [&](const glm::vec2& place) {
        return glm::clamp((0.5f * place + 0.5f) * glm::vec2(size), glm::vec2(-1e6f), glm::vec2(1e6f));
    };
    const glm::vec2 first = (glm::floor(pixels(least) / d) - 1.0f) * d, past = (glm::ceil(pixels(most) / d) + 1.0f) * d;
    const glm::uvec2 from(glm::clamp(first, glm::vec2(0), glm::vec2(size)));
    const glm::uvec2 to(glm::clamp(past, glm::vec2(0), glm::vec2(size)));
    return {from / quality.divisor * quality.divisor, to};
}

void VolumeSource::march(Plan& plan, const View& view) {
    const uint32_t d = quality.divisor, width = (view.width + d - 1) / d, height = (view.height + d - 1) / d;
    const uint64_t pixels = uint64_t{view.width} * view.height;
    const glm::uvec2 across = glm::uvec2(marched_.z, marched_.w) - glm::uvec2(marched_);
    if (d > 1) {
        buffers_.make_room(plan, LODE_VOLUME_TAPS, uint64_t{16} * width * height);
        buffers_.make_room(plan, LODE_VOLUME_MISFITS, 4 * (LODE_MISFITS_HEAD + pixels));
        buffers_.upload(plan, LODE_VOLUME_MISFITS, {0, 1, 1, 0});
    }
    dispatch(plan, march_pipeline, {groups_of((across.x + d - 1) / d), groups_of((across.y + d - 1) / d), 1});
    if (d > 1) {
        dispatch(plan, upsample_pipeline, {groups_of(across.x), groups_of(across.y), 1});
        Dispatch listed;
        listed.pipeline = misfits_pipeline;
        listed.arguments = LODE_VOLUME_MISFITS;
        plan.commands.push_back({Stage::effect, listed});
    }
}

// By turns: as many bricks as the cache takes are filled, in their layers, and then marched in the order of the eye.
void VolumeSource::march_by_metavoxel(Plan& plan, const View& view) {
    const glm::vec3 eye(lattice_.world_to_lattice() * glm::vec4(glm::vec3(view.eye), 1));
    const std::vector<EyeOrdered> order = eye_order(lattice_, shown_.bins, eye);
    std::vector<uint32_t> words;
    for (const EyeOrdered& o : order) words.push_back(o.brick | (o.under ? LODE_ORDERED_UNDER : 0));
    buffers_.upload(plan, LODE_VOLUME_ORDER, std::move(words));
    const BufferSpec& pool = buffers_[LODE_VOLUME_VOXELS];
    const auto count = static_cast<uint32_t>(order.size());
    uint32_t cache = std::min(count, static_cast<uint32_t>(pool.most_bytes / pool.stride));
    if (quality.cache > 0) cache = std::min(cache, quality.cache);
    buffers_.make_room(plan, LODE_VOLUME_VOXELS, uint64_t{cache} * lattice_.brick_words() * 4);
    const uint32_t tiles = groups_of(lattice_.voxels + 1);
    const glm::uvec2 across = glm::uvec2(marched_.z, marched_.w) - glm::uvec2(marched_);
    for (uint32_t first = 0; first < count; first += cache) {
        const uint32_t past = std::min(first + cache, count);
        // The order has the bricks of a layer together, as the bins have them.
        for_each_layer(shown_.bins, first, past, [&](uint32_t from, uint32_t to) {
            dispatch_bricks(plan, fill_alone_pipeline, tiles * tiles, from, to - from, {0, 1, first});
        });
        if (across.x > 0 && across.y > 0)
            dispatch(plan, by_metavoxel_pipeline, {groups_of(across.x), groups_of(across.y), 1},
                     {first, past - first, first == 0 ? 1U : 0U});
    }
    filled_now_ = count;
}

Plan VolumeSource::plan(const FrameInput& input) {
    LODE_CHECK(!input.views.empty() && quality.steps > 0 && quality.divisor >= 1 && quality.divisor <= 4, quality.steps,
               quality.divisor);
    const View& view = input.views[0];
    Plan plan;
    plan.generation = recipe().generation;
    marched_ = glm::uvec4(0);
    if (uint64_t{8} * view.width * view.height > most_block_bytes) {
        if (!std::exchange(warned_size_, true))
            plan.warnings.push_back("volumes: a picture of " + std::to_string(view.width) + "x" +
                                    std::to_string(view.height) + " pixels is too large for them; it has none");
        return plan;
    }
    if (std::exchange(by_metavoxel_, quality.by_metavoxel) != quality.by_metavoxel) filled_ = false;
    renew_lattice(input.light_direction);
    fill(plan, input);
    if (shown_.bins.bricks.empty()) {
        // Nothing of it is seen, so nothing is sent; the next frame that has something begins anew.
        Plan none;
        none.generation = plan.generation;
        none.warnings = std::move(plan.warnings);
        filled_ = false;
        columns_.clear();
        return none;
    }
    marched_ = pixels_of_bricks(view);
    upload_constants(plan, view);
    const bool seen = marched_.x < marched_.z && marched_.y < marched_.w;
    if (seen) buffers_.make_room(plan, LODE_VOLUME_RESULT, uint64_t{8} * view.width * view.height);
    if (by_metavoxel_) {
        march_by_metavoxel(plan, view);
    } else if (seen) {
        march(plan, view);
    }
    if (seen) {
        Draw draw;
        draw.pipeline = composite_pipeline;
        draw.count = 3;
        plan.commands.push_back({Stage::composite, draw});
    }
    const double bricks = static_cast<double>(shown_.bins.bricks.size());
    plan.stats.resident_bytes = buffers_.bytes();
    plan.stats.more = {{"bricks", bricks},
                       {"metavoxels", lattice_.metavoxel_count()},
                       {"brick_bytes", bricks * 4 * lattice_.brick_words()},
                       {"across", across_},
                       {"filled", filled_now_}};
    return plan;
}

Result<void> VolumeSource::validate() const {
    for (const Bricks* bricks : {&shown_, &next_}) {
        if (bricks->bins.bricks.empty()) continue;
        if (auto good = bricks->bins.validate(lattice_); !good) return good;
        const uint64_t bytes = uint64_t{4} * lattice_.brick_words() * bricks->end();
        if (!by_metavoxel_ && bytes > buffers_[LODE_VOLUME_VOXELS].bytes)
            return fail(Fault::invariant, "volumes: bricks lie past the pool");
    }
    const bool apart = next_.first_slot >= shown_.end() || next_.end() <= shown_.first_slot;
    if (!next_.bins.bricks.empty() && !apart)
        return fail(Fault::invariant, "volumes: bricks that are being filled lie on those that are seen");
    return {};
}

}  // namespace lodestone::volume
