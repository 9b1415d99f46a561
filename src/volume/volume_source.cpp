#include "volume/volume_source.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "base/check.h"
#include "shaders/shared/light_grid.h"
#include "shaders/shared/volume.h"
#include "volume/noise_cube.h"

namespace lodestone::volume {

namespace {

// Buffers have the numbers of their bindings.
constexpr uint32_t buffer_count = LODE_VOLUME_MISFITS + 1;
enum Pipeline : uint32_t {
    fill_pipeline,
    halo_pipeline,
    no_light_pipeline,
    march_pipeline,
    upsample_pipeline,
    misfits_pipeline,
    composite_pipeline
};
constexpr uint64_t most_block_bytes = uint64_t{1} << 27;  // of a buffer that is bound at once, on every device
constexpr uint64_t most_light_places = uint64_t{1} << 22;
constexpr uint32_t fewest_bricks = 8;  // that a pool must hold

uint32_t word_of(float value) { return std::bit_cast<uint32_t>(value); }

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

BufferSpec buffer_spec(const char* name, uint64_t bytes, uint32_t stride = 4, uint64_t most = 0, uint32_t use = 0) {
    BufferSpec spec;
    spec.name = name;
    spec.bytes = (bytes + stride - 1) / stride * stride;
    spec.stride = stride;
    spec.use = use_storage | use;
    spec.most_bytes = most / stride * stride;
    return spec;
}

StorageBinding plain(uint32_t binding, Access access) { return {binding, binding, access, 0, 1}; }
StorageBinding texels(uint32_t binding, uint32_t words) { return StorageBinding::texels(binding, binding, words); }

PipelineSpec compute(const char* name, std::vector<StorageBinding> storage, std::vector<uint32_t> constants = {}) {
    PipelineSpec spec;
    spec.name = std::string("volume ") + name;
    spec.kind = PipelineKind::compute;
    spec.compute = std::string("volume/") + name + ".comp";
    spec.storage = std::move(storage);
    spec.storage.push_back(plain(LODE_VOLUME_CONSTANTS, Access::read));
    spec.constants = std::move(constants);
    return spec;
}

std::vector<PipelineSpec> pipelines_of(bool has_tables) {
    const auto pool = [](Access access) {
        return StorageBinding::stored_pool(LODE_VOLUME_VOXELS, LODE_VOLUME_VOXELS, access);
    };
    std::vector<StorageBinding> marched = {texels(LODE_VOLUME_TABLE, 1), texels(LODE_VOLUME_BRICKS, 4),
                                           StorageBinding::pool(LODE_VOLUME_VOXELS, LODE_VOLUME_VOXELS, 1),
                                           texels(LODE_VOLUME_SCALES, 1), plain(LODE_VOLUME_RESULT, Access::write)};
    auto targeted = marched;
    targeted.push_back(plain(LODE_VOLUME_TAPS, Access::write));
    auto listed = marched;
    listed.push_back(plain(LODE_VOLUME_MISFITS, Access::read));
    std::vector<PipelineSpec> all(composite_pipeline + 1);
    all[fill_pipeline] =
        compute("fill",
                {texels(LODE_VOLUME_BRICKS, 4), texels(LODE_VOLUME_BLOCKS, 2), texels(LODE_VOLUME_LIST, 1),
                 texels(LODE_VOLUME_PARTICLES, 4), texels(LODE_VOLUME_LOOKS, 4), texels(LODE_VOLUME_NOISE, 1),
                 pool(Access::read_write), plain(LODE_VOLUME_FRONT, Access::read_write),
                 plain(LODE_VOLUME_LIGHT, Access::read_write), plain(LODE_VOLUME_SCALES, Access::read_write)},
                {has_tables ? 1U : 0U});
    all[halo_pipeline] =
        compute("halo", {texels(LODE_VOLUME_TABLE, 1), texels(LODE_VOLUME_BRICKS, 4), pool(Access::read_write)});
    all[no_light_pipeline] =
        compute("no_light", {plain(LODE_VOLUME_LIGHT, Access::read_write), texels(LODE_VOLUME_TABLE, 1)});
    all[march_pipeline] = compute("march", targeted);
    all[upsample_pipeline] = compute("upsample", {texels(LODE_VOLUME_TAPS, 4), plain(LODE_VOLUME_RESULT, Access::write),
                                                  plain(LODE_VOLUME_MISFITS, Access::read_write)});
    all[misfits_pipeline] = compute("misfits", listed);
    PipelineSpec& composite = all[composite_pipeline];
    composite.name = "volume composite";
    composite.vertex = "frame/whole_view.vert";
    composite.fragment = "volume/composite.frag";
    composite.whole_view = true;
    composite.blend = Blend::over;
    composite.storage = {texels(LODE_VOLUME_RESULT, 2), plain(LODE_VOLUME_CONSTANTS, Access::read)};
    return all;
}

std::vector<uint32_t> words_of_looks(const std::vector<Emitter>& emitters) {
    std::vector<uint32_t> words, tables;
    const auto first_table = static_cast<uint32_t>(4 * emitters.size());
    for (const Emitter& e : emitters) {
        const Look& look = e.look;
        const float by = look.colour_by == ColourBy::radius         ? 0.0f
                         : look.colour_by == ColourBy::displacement ? 1.0f
                                                                    : 2.0f;
        for (const auto& [colour, density] :
             {std::pair(look.colour_from, look.density_from), std::pair(look.colour_to, look.density_to)}) {
            for (int c = 0; c < 3; ++c) words.push_back(word_of(colour[c]));
            words.push_back(word_of(density));
        }
        for (const float value : {look.scatter, look.emission, by, 0.0f}) words.push_back(word_of(value));
        const uint32_t table[] = {first_table + static_cast<uint32_t>(tables.size() / 4),
                                  static_cast<uint32_t>(look.table.size()), 0, 0};
        words.insert(words.end(), std::begin(table), std::end(table));
        for (const glm::vec4& entry : look.table) {
            for (int c = 0; c < 4; ++c) tables.push_back(word_of(entry[c]));
        }
    }
    words.insert(words.end(), tables.begin(), tables.end());
    return words;
}

float most_density_of(const Look& look) {
    float factor = 1;
    if (!look.table.empty()) {
        factor = 0;
        for (const glm::vec4& entry : look.table) factor = std::max(factor, entry.w);
    }
    return factor * std::max(look.density_from, look.density_to);
}

// Eight times the densest particle: where more overlap than that, nothing is seen through a voxel anyway.
float most_density_of(const std::vector<Emitter>& emitters) {
    float most = 1e-6f;
    for (const Emitter& e : emitters) most = std::max(most, most_density_of(e.look));
    return 8 * most;
}

float most_emission_of(const std::vector<Emitter>& emitters) {
    float most = 0;
    for (const Emitter& e : emitters) {
        glm::vec3 colour = glm::max(e.look.colour_from, e.look.colour_to);
        for (const glm::vec4& entry : e.look.table) colour = glm::max(colour, glm::vec3(entry));
        most = std::max(most, e.look.emission * std::max(colour.x, std::max(colour.y, colour.z)));
    }
    return most;
}

}  // namespace

Result<std::unique_ptr<VolumeSource>> VolumeSource::open(std::vector<Emitter> emitters, const VolumeOptions& options) {
    LODE_CHECK(!emitters.empty());
    std::unique_ptr<VolumeSource> source(new VolumeSource(std::move(emitters), options));
    const uint64_t brick_bytes = uint64_t{4} * (options.voxels + 1) * (options.voxels + 1) * (options.voxels + 1);
    if (options.pool_bytes < fewest_bricks * brick_bytes)
        return over_budget("bricks of volumes", fewest_bricks * brick_bytes, options.pool_bytes);
    return source;
}

VolumeSource::VolumeSource(std::vector<Emitter> emitters, const VolumeOptions& options)
    : emitters_(std::move(emitters)), options_(options), across_(options.metavoxels) {
    LODE_CHECK(options.metavoxels >= 1 && options.metavoxels <= most_metavoxels, options.metavoxels);
    const uint64_t across = options.metavoxels, voxels = options.voxels, side = across * voxels;
    const uint64_t brick = 4 * (voxels + 1) * (voxels + 1) * (voxels + 1);
    const uint64_t cells = across * across * across, slots = std::min(options.pool_bytes / brick, cells);
    const uint64_t blocks =
        blocks_across(options.voxels) * blocks_across(options.voxels) * blocks_along(options.voxels);
    uint64_t particles = 0;
    for (const Emitter& e : emitters_) particles += e.particles;
    const bool tables = std::ranges::any_of(emitters_, [](const Emitter& e) { return !e.look.table.empty(); });
    // No lattice has more places than a cube, as close together as they ever are.
    const uint64_t places = std::min(side * side * ((side + 3) / 4), most_light_places);
    recipe_.generation = 1;
    recipe_.buffers.resize(buffer_count);
    const auto add = [&](uint32_t number, BufferSpec spec) { recipe_.buffers[number] = std::move(spec); };
    add(LODE_VOLUME_CONSTANTS, buffer_spec("volume constants", sizeof(gpu::VolumeConstants)));
    add(LODE_VOLUME_TABLE, buffer_spec("volume table", 4 * cells));
    add(LODE_VOLUME_BRICKS, buffer_spec("volume bricks", 16, 16, 16 * slots));
    add(LODE_VOLUME_BLOCKS, buffer_spec("volume blocks", 8, 8, 8 * blocks * slots));
    add(LODE_VOLUME_LIST, buffer_spec("volume list", 4, 4, most_block_bytes));
    add(LODE_VOLUME_PARTICLES, buffer_spec("volume particles", 48 * particles, 16));
    add(LODE_VOLUME_LOOKS, buffer_spec("volume looks", 4 * words_of_looks(emitters_).size(), 16));
    add(LODE_VOLUME_NOISE, buffer_spec("volume noise", uint64_t{24} * NoiseCube::cells * NoiseCube::cells));
    add(LODE_VOLUME_VOXELS, buffer_spec("volume voxels", brick, static_cast<uint32_t>(brick), slots * brick));
    add(LODE_VOLUME_FRONT, buffer_spec("volume front", 12, 4, 12 * side * side));
    add(LODE_VOLUME_LIGHT, buffer_spec("volume light", 4 * (LODE_LIGHT_GRID_HEAD + places)));
    add(LODE_VOLUME_SCALES, buffer_spec("volume scales", 16));
    add(LODE_VOLUME_TAPS, buffer_spec("volume taps", 16, 16, most_block_bytes));
    add(LODE_VOLUME_RESULT, buffer_spec("volume result", 8, 8, most_block_bytes));
    add(LODE_VOLUME_MISFITS, buffer_spec("volume misfits", 4 * LODE_MISFITS_HEAD, 4, most_block_bytes, use_indirect));
    recipe_.pipelines = pipelines_of(tables);
    recipe_.light_grid = LODE_VOLUME_LIGHT;
}

uint32_t VolumeSource::result_buffer() const { return LODE_VOLUME_RESULT; }

void VolumeSource::make_room(Plan& plan, uint32_t buffer, uint64_t bytes) {
    BufferSpec& spec = recipe_.buffers[buffer];
    if (spec.bytes >= bytes) return;
    // A quarter more than is needed, so that it does not grow every frame.
    const uint64_t wanted = (bytes + bytes / 4 + spec.stride - 1) / spec.stride * spec.stride;
    spec.bytes = std::min(std::max(wanted, uint64_t{spec.stride}), spec.most_bytes);
    LODE_CHECK(spec.bytes >= bytes, spec.name, bytes, spec.most_bytes);
    plan.commands.push_back({Stage::update, Resize{buffer, spec.bytes, 0}});
}

void VolumeSource::upload(Plan& plan, uint32_t buffer, std::vector<uint32_t> words) {
    if (words.empty()) words.push_back(0);
    if (recipe_.buffers[buffer].most_bytes > 0) make_room(plan, buffer, words.size() * 4);
    LODE_CHECK(words.size() * 4 <= recipe_.buffers[buffer].bytes, recipe_.buffers[buffer].name, words.size());
    plan.stats.uploaded_bytes += words.size() * 4;
    plan.commands.push_back({Stage::update, Upload{buffer, 0, Blob::copy_of(words.data(), words.size())}});
}

// A lattice for the light, if it is another than before or coarser.
bool VolumeSource::renew_lattice(const glm::vec3& light) {
    if (filled_ && light == light_) return false;
    light_ = light;
    lattice_ = lattice_around(emitters_, light, across_, options_.voxels);
    const LightGrid grid = light_grid_of(lattice_.metavoxels * lattice_.voxels);
    light_places_ = grid.places;
    light_spacing_ = grid.across;
    light_step_ = grid.along;
    return true;
}

// What is left out has no density, and costs nothing.
std::vector<Particle> VolumeSource::seen_particles(double time) const {
    std::vector<Particle> particles = particles_at(emitters_, time);
    std::erase_if(particles, [&](Particle& p) {
        p.density *= quality.density;
        return !(p.density * most_density_of(emitters_[p.emitter].look) > 0);
    });
    return particles;
}

// Fewer metavoxels across, until the pool holds those that are not empty. It stays so.
void VolumeSource::coarsen(Plan& plan, const std::vector<Particle>& particles) {
    const uint64_t slots = recipe_.buffers[LODE_VOLUME_VOXELS].most_bytes / recipe_.buffers[LODE_VOLUME_VOXELS].stride;
    const uint32_t asked = across_;
    uint32_t needed = count_bricks(lattice_, particles);
    const uint32_t first_needed = needed;
    while (needed > slots && across_ > 1) {
        across_ = std::max(across_ * 7 / 8, 1U);
        filled_ = false;
        renew_lattice(light_);
        needed = count_bricks(lattice_, particles);
    }
    if (across_ == asked) return;
    std::ranges::fill(columns_, 1);
    plan.warnings.push_back("volumes: " + std::to_string(first_needed) +
                            " metavoxels are not empty and the pool holds " + std::to_string(slots) +
                            "; from now on there are " + std::to_string(across_) + " across in place of " +
                            std::to_string(asked) + ". Raise pool_mib in the scene to have them finer");
}

void VolumeSource::upload_bins(Plan& plan, const std::vector<Particle>& particles) {
    std::vector<uint32_t> table(lattice_.metavoxel_count(), LODE_NO_BRICK), bricks, blocks, words;
    for (uint32_t b = 0; b < bins_.bricks.size(); ++b) {
        const Brick& brick = bins_.bricks[b];
        table[(brick.at.z * lattice_.metavoxels.y + brick.at.y) * lattice_.metavoxels.x + brick.at.x] = b;
        bricks.push_back(brick.at.x | brick.at.y << 10 | brick.at.z << 20 | (brick.first ? 1U << 30 : 0));
        bricks.push_back(brick.gap_before | brick.gap_after << 16);
        bricks.push_back(static_cast<uint32_t>(brick.occupied));
        bricks.push_back(static_cast<uint32_t>(brick.occupied >> 32));
    }
    for (size_t k = 0; k < bins_.first_particle.size(); ++k) {
        blocks.push_back(bins_.first_particle[k]);
        blocks.push_back(bins_.particle_count[k]);
    }
    const glm::mat4 to_lattice = lattice_.world_to_lattice();
    for (const Particle& p : particles) {
        const glm::vec3 centre(to_lattice * glm::vec4(p.centre, 1));
        // From lattice space to that of the noise.
        const glm::quat turn = p.to_noise * glm::quat_cast(glm::transpose(lattice_.turned));
        for (const float value : {centre.x, centre.y, centre.z, p.radius / lattice_.voxel, turn.x, turn.y, turn.z,
                                  turn.w, p.displacement, p.age, p.density})
            words.push_back(word_of(value));
        words.push_back(p.emitter);
    }
    upload(plan, LODE_VOLUME_TABLE, std::move(table));
    upload(plan, LODE_VOLUME_BRICKS, std::move(bricks));
    upload(plan, LODE_VOLUME_BLOCKS, std::move(blocks));
    upload(plan, LODE_VOLUME_LIST, bins_.particles);
    upload(plan, LODE_VOLUME_PARTICLES, std::move(words));
}

void VolumeSource::dispatch_fill(Plan& plan, bool columns_emptied) {
    const uint32_t tiles = blocks_across(lattice_.voxels) * blocks_across(lattice_.voxels);
    const auto dispatch = [&](Pipeline pipeline, uint32_t x, uint32_t first, uint32_t count) {
        for (uint32_t done = 0; done < count; done += most_groups) {
            Dispatch d;
            d.pipeline = pipeline;
            d.groups = {x, std::min(count - done, most_groups), 1};
            d.words[0] = first + done;
            plan.commands.push_back({Stage::effect, d});
        }
    };
    const auto bricks = static_cast<uint32_t>(bins_.bricks.size());
    make_room(plan, LODE_VOLUME_VOXELS, uint64_t{bricks} * lattice_.brick_words() * 4);
    const glm::uvec3 side = lattice_.metavoxels * lattice_.voxels;
    make_room(plan, LODE_VOLUME_FRONT, uint64_t{12} * side.x * side.y);
    if (columns_emptied) {
        Dispatch d;
        d.pipeline = no_light_pipeline;
        d.groups = {(light_places_.x + 7) / 8, (light_places_.y + 7) / 8, 1};
        plan.commands.push_back({Stage::effect, d});
    }
    for (uint32_t layer = 0; layer < lattice_.metavoxels.z; ++layer) {
        const uint32_t first = bins_.first_brick[layer];
        dispatch(fill_pipeline, tiles, first, bins_.first_brick[layer + 1] - first);
    }
    dispatch(halo_pipeline, lattice_.voxels + 1, 0, bricks);
}

// Bricks for what is there at this time. Frames that find nothing leave bins_ empty.
void VolumeSource::fill(Plan& plan, const FrameInput& input) {
    const std::vector<Particle> particles = seen_particles(input.time);
    coarsen(plan, particles);
    bins_ = bin_particles(lattice_, particles);
    if (bins_.crowded && !std::exchange(warned_crowd_, true))
        plan.warnings.push_back("volumes: more than " + std::to_string(most_in_block) +
                                " particles meet in one place; those after them are left out there");
    if (bins_.bricks.empty()) return;
    const size_t columns = size_t{lattice_.metavoxels.x} * lattice_.metavoxels.y;
    bool emptied = columns_.size() != columns || !filled_;
    columns_.resize(columns, 1);
    std::vector<uint8_t> now(columns, 0);
    for (const Brick& brick : bins_.bricks) now[size_t{brick.at.y} * lattice_.metavoxels.x + brick.at.x] = 1;
    for (size_t c = 0; c < columns; ++c) emptied = emptied || (columns_[c] != 0 && now[c] == 0);
    columns_ = std::move(now);
    if (!std::exchange(statics_sent_, true)) {
        upload(plan, LODE_VOLUME_LOOKS, words_of_looks(emitters_));
        upload(plan, LODE_VOLUME_NOISE, make_noise_cube(1).words());
    }
    upload_bins(plan, particles);
    dispatch_fill(plan, emptied);
    filled_density_ = std::max(quality.density, 1e-6f);
    filled_ = true;
    filled_frame_ = input.frame;
}

void VolumeSource::upload_constants(Plan& plan, const View& view) {
    gpu::VolumeConstants c{};
    c.world_to_lattice = lattice_.world_to_lattice();
    c.lattice_to_world = lattice_.lattice_to_world();
    c.metavoxels = glm::uvec4(lattice_.metavoxels, lattice_.voxels);
    c.light_places = glm::uvec4(light_places_, light_spacing_);
    const uint32_t d = quality.divisor;
    c.picture = {view.width, view.height, (view.width + d - 1) / d, (view.height + d - 1) / d};
    c.voxel = lattice_.voxel;
    c.step_length = lattice_.voxel / quality.steps;
    c.far_plane = view.far_plane;
    c.near_plane = view.near_plane;
    c.most_density = most_density_of(emitters_) * filled_density_;
    c.emission = most_emission_of(emitters_);
    c.forward = options_.forward;
    c.divisor = d;
    c.absorption = quality.absorption == Absorption::exponential ? LODE_ABSORPTION_EXP : LODE_ABSORPTION_RATIONAL;
    c.light_step = light_step_;
    c.skips = quality.skips_empty ? 1 : 0;
    std::vector<uint32_t> words(sizeof c / 4);
    std::memcpy(words.data(), &c, sizeof c);
    upload(plan, LODE_VOLUME_CONSTANTS, std::move(words));
}

void VolumeSource::march(Plan& plan, const View& view) {
    const uint32_t d = quality.divisor, width = (view.width + d - 1) / d, height = (view.height + d - 1) / d;
    const auto dispatch = [&](Pipeline pipeline, uint32_t w, uint32_t h) {
        Dispatch command;
        command.pipeline = pipeline;
        command.groups = {(w + 7) / 8, (h + 7) / 8, 1};
        plan.commands.push_back({Stage::effect, command});
    };
    const uint64_t pixels = uint64_t{view.width} * view.height;
    make_room(plan, LODE_VOLUME_RESULT, 8 * pixels);
    if (d > 1) {
        make_room(plan, LODE_VOLUME_TAPS, uint64_t{16} * width * height);
        make_room(plan, LODE_VOLUME_MISFITS, 4 * (LODE_MISFITS_HEAD + pixels));
        upload(plan, LODE_VOLUME_MISFITS, {0, 1, 1, 0});
    }
    dispatch(march_pipeline, width, height);
    if (d > 1) {
        dispatch(upsample_pipeline, view.width, view.height);
        Dispatch listed;
        listed.pipeline = misfits_pipeline;
        listed.arguments = LODE_VOLUME_MISFITS;
        plan.commands.push_back({Stage::effect, listed});
    }
    Draw draw;
    draw.pipeline = composite_pipeline;
    draw.count = 3;
    plan.commands.push_back({Stage::composite, draw});
}

Plan VolumeSource::plan(const FrameInput& input) {
    LODE_CHECK(!input.views.empty() && quality.steps > 0 && quality.divisor >= 1 && quality.divisor <= 4, quality.steps,
               quality.divisor);
    const View& view = input.views[0];
    Plan plan;
    plan.generation = recipe_.generation;
    if (uint64_t{8} * view.width * view.height > most_block_bytes) {
        if (!std::exchange(warned_size_, true))
            plan.warnings.push_back("volumes: a picture of " + std::to_string(view.width) + "x" +
                                    std::to_string(view.height) + " pixels is too large for them; it has none");
        return plan;
    }
    const bool renewed = renew_lattice(input.light_direction);
    if (renewed) filled_ = false;
    const bool due = !filled_ || (quality.refresh > 0 && input.frame - filled_frame_ >= quality.refresh);
    if (due) fill(plan, input);
    if (bins_.bricks.empty()) {
        // Nothing of it is seen, so nothing is sent; the next frame that has something begins anew.
        Plan none;
        none.generation = plan.generation;
        none.warnings = std::move(plan.warnings);
        filled_ = false;
        return none;
    }
    upload_constants(plan, view);
    const glm::vec3 middle(lattice_.lattice_to_world() *
                           glm::vec4(0.5f * glm::vec3(lattice_.metavoxels * lattice_.voxels), 1));
    const float radius = 0.5f * lattice_.voxel * glm::length(glm::vec3(lattice_.metavoxels * lattice_.voxels));
    if (frustum_of(view).touches(middle, radius)) march(plan, view);
    for (const BufferSpec& buffer : recipe_.buffers) plan.stats.resident_bytes += buffer.bytes;
    const double bricks = static_cast<double>(bins_.bricks.size());
    plan.stats.more = {{"bricks", bricks},
                       {"metavoxels", lattice_.metavoxel_count()},
                       {"brick_bytes", bricks * 4 * lattice_.brick_words()},
                       {"across", across_},
                       {"filled", due ? 1 : 0}};
    return plan;
}

Result<void> VolumeSource::validate() const {
    if (bins_.bricks.empty()) return {};
    if (auto good = bins_.validate(lattice_); !good) return good;
    const uint64_t bytes = uint64_t{4} * lattice_.brick_words() * bins_.bricks.size();
    if (bytes > recipe_.buffers[LODE_VOLUME_VOXELS].bytes)
        return fail(Fault::invariant, "volumes: bricks lie past the pool");
    return {};
}

}  // namespace lodestone::volume
