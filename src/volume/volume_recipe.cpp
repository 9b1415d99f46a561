#include "volume/volume_recipe.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "base/check.h"
#include "shaders/shared/light_grid.h"
#include "shaders/shared/volume.h"
#include "volume/binning.h"
#include "volume/noise_cube.h"

namespace lodestone::volume {

namespace {

uint32_t word_of(float value) { return std::bit_cast<uint32_t>(value); }

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

std::vector<PipelineSpec> pipelines_of(bool has_tables, bool has_grids) {
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
    auto ordered = marched;
    std::ranges::find(ordered, uint32_t{LODE_VOLUME_RESULT}, &StorageBinding::binding)->access = Access::read_write;
    ordered.push_back(texels(LODE_VOLUME_ORDER, 1));
    std::vector<PipelineSpec> all(composite_pipeline + 1);
    for (const bool alone : {false, true}) {
        PipelineSpec& fill = all[alone ? fill_alone_pipeline : fill_pipeline];
        fill = compute("fill",
                       {texels(LODE_VOLUME_TABLE, 1), texels(LODE_VOLUME_BRICKS, 4), texels(LODE_VOLUME_BLOCKS, 2),
                        texels(LODE_VOLUME_LIST, 1), texels(LODE_VOLUME_PARTICLES, 4), texels(LODE_VOLUME_LOOKS, 4),
                        texels(LODE_VOLUME_NOISE, 1), texels(LODE_VOLUME_ORDER, 1), pool(Access::read_write),
                        plain(LODE_VOLUME_FRONT, Access::read_write), plain(LODE_VOLUME_LIGHT, Access::read_write),
                        plain(LODE_VOLUME_SCALES, Access::read_write), texels(LODE_VOLUME_GRIDS, 4),
                        texels(LODE_VOLUME_GRID_INDEX, 1), texels(LODE_VOLUME_GRID_VALUES, 1)},
                       {has_tables ? 1U : 0U, alone ? 1U : 0U, has_grids ? 1U : 0U});
        if (alone) fill.name = "volume fill alone";
    }
    all[halo_pipeline] =
        compute("halo", {texels(LODE_VOLUME_TABLE, 1), texels(LODE_VOLUME_BRICKS, 4), pool(Access::read_write)});
    all[no_light_pipeline] =
        compute("no_light", {plain(LODE_VOLUME_LIGHT, Access::read_write), texels(LODE_VOLUME_TABLE, 1)});
    all[march_pipeline] = compute("march", targeted);
    all[upsample_pipeline] = compute("upsample", {texels(LODE_VOLUME_TAPS, 4), plain(LODE_VOLUME_RESULT, Access::write),
                                                  plain(LODE_VOLUME_MISFITS, Access::read_write)});
    all[misfits_pipeline] = compute("misfits", listed);
    all[by_metavoxel_pipeline] = compute("by_metavoxel", ordered);
    PipelineSpec& composite = all[composite_pipeline];
    composite.name = "volume composite";
    composite.vertex = "frame/whole_view.vert";
    composite.fragment = "volume/composite.frag";
    composite.whole_view = true;
    composite.blend = Blend::over;
    composite.storage = {texels(LODE_VOLUME_RESULT, 2), plain(LODE_VOLUME_CONSTANTS, Access::read)};
    return all;
}

}  // namespace

uint64_t brick_bytes(uint32_t voxels) { return uint64_t{4} * (voxels + 1) * (voxels + 1) * (voxels + 1); }

Recipe recipe_of(const VolumeSizes& sizes, const std::vector<Emitter>& emitters, const GridWords& grids) {
    const uint64_t across = sizes.across, side = across * sizes.voxels, cells = across * across * across;
    const uint64_t brick = brick_bytes(sizes.voxels), slots = sizes.slots;
    const uint64_t blocks =
        uint64_t{blocks_across(sizes.voxels)} * blocks_across(sizes.voxels) * blocks_along(sizes.voxels);
    uint64_t particles = 0;
    for (const Emitter& e : emitters) particles += e.particles;
    Recipe recipe;
    recipe.generation = 1;
    recipe.buffers.resize(LODE_VOLUME_GRID_VALUES + 1);
    const auto add = [&](uint32_t number, BufferSpec spec) { recipe.buffers[number] = std::move(spec); };
    add(LODE_VOLUME_CONSTANTS, buffer_spec("volume constants", sizeof(gpu::VolumeConstants)));
    add(LODE_VOLUME_TABLE, buffer_spec("volume table", 2 * 4 * cells));
    add(LODE_VOLUME_BRICKS, buffer_spec("volume bricks", 16, 16, 16 * cells));
    add(LODE_VOLUME_BLOCKS, buffer_spec("volume blocks", 8, 8, 8 * blocks * cells));
    add(LODE_VOLUME_LIST, buffer_spec("volume list", 4, 4, most_block_bytes));
    add(LODE_VOLUME_PARTICLES, buffer_spec("volume particles", 48 * particles, 16));
    add(LODE_VOLUME_LOOKS, buffer_spec("volume looks", 4 * words_of_looks(emitters).size(), 16));
    add(LODE_VOLUME_NOISE, buffer_spec("volume noise", uint64_t{24} * NoiseCube::cells * NoiseCube::cells));
    add(LODE_VOLUME_VOXELS, buffer_spec("volume voxels", brick, static_cast<uint32_t>(brick), slots * brick));
    add(LODE_VOLUME_FRONT, buffer_spec("volume front", 12, 4, 2 * 12 * side * side));
    add(LODE_VOLUME_LIGHT, buffer_spec("volume light", 4 * (LODE_LIGHT_GRID_HEAD + sizes.light_places)));
    add(LODE_VOLUME_SCALES, buffer_spec("volume scales", 16));
    add(LODE_VOLUME_TAPS, buffer_spec("volume taps", 16, 16, most_block_bytes));
    add(LODE_VOLUME_RESULT, buffer_spec("volume result", 8, 8, most_block_bytes));
    add(LODE_VOLUME_MISFITS, buffer_spec("volume misfits", 4 * LODE_MISFITS_HEAD, 4, most_block_bytes, use_indirect));
    add(LODE_VOLUME_ORDER, buffer_spec("volume order", 4, 4, 4 * cells));
    add(LODE_VOLUME_GRIDS, buffer_spec("volume grids", 4 * grids.placed_count(), 16));
    add(LODE_VOLUME_GRID_INDEX, buffer_spec("volume grid index", 4 * grids.index_count()));
    add(LODE_VOLUME_GRID_VALUES, buffer_spec("volume grid values", 4 * grids.value_count()));
    const bool tables = std::ranges::any_of(emitters, [](const Emitter& e) { return !e.look.table.empty(); });
    recipe.pipelines = pipelines_of(tables, !grids.empty());
    recipe.light_grid = LODE_VOLUME_LIGHT;
    return recipe;
}

uint64_t VolumeBuffers::bytes() const {
    uint64_t sum = 0;
    for (const BufferSpec& buffer : recipe_.buffers) sum += buffer.bytes;
    return sum;
}

void VolumeBuffers::make_room(Plan& plan, uint32_t buffer, uint64_t bytes, uint64_t kept) {
    BufferSpec& spec = recipe_.buffers[buffer];
    if (spec.bytes >= bytes) return;
    kept = std::min(kept, spec.bytes);
    // More than is needed, so that it does not grow every frame.
    const uint64_t wanted = (bytes + bytes / 8 + spec.stride - 1) / spec.stride * spec.stride;
    spec.bytes = std::min(std::max(wanted, uint64_t{spec.stride}), spec.most_bytes);
    LODE_CHECK(spec.bytes >= bytes, spec.name, bytes, spec.most_bytes);
    plan.commands.push_back({Stage::update, Resize{buffer, spec.bytes, kept}});
}

void VolumeBuffers::upload(Plan& plan, uint32_t buffer, std::vector<uint32_t> words, uint64_t offset) {
    if (words.empty()) words.push_back(0);
    const uint64_t end = offset + words.size() * 4;
    if (recipe_.buffers[buffer].most_bytes > 0) make_room(plan, buffer, end, offset);
    LODE_CHECK(end <= recipe_.buffers[buffer].bytes, recipe_.buffers[buffer].name, end);
    plan.stats.uploaded_bytes += words.size() * 4;
    plan.commands.push_back({Stage::update, Upload{buffer, offset, Blob::copy_of(words.data(), words.size())}});
}

std::vector<uint32_t> words_of_looks(const std::vector<Emitter>& emitters) {
    std::vector<uint32_t> words, tables;
    const auto first_table = static_cast<uint32_t>(4 * emitters.size());
    uint32_t grids = 0;  // so far
    for (const Emitter& e : emitters) {
        const Look& look = e.look;
        // Of a grid, it goes by how thick it is, which is in the place of the radius.
        const float by = look.colour_by == ColourBy::radius || e.grid ? 0.0f
                         : look.colour_by == ColourBy::displacement   ? 1.0f
                                                                      : 2.0f;
        for (const auto& [colour, density] :
             {std::pair(look.colour_from, look.density_from), std::pair(look.colour_to, look.density_to)}) {
            for (int c = 0; c < 3; ++c) words.push_back(word_of(colour[c]));
            words.push_back(word_of(density));
        }
        for (const float value : {look.scatter, look.emission, by, 0.0f}) words.push_back(word_of(value));
        const uint32_t table[] = {first_table + static_cast<uint32_t>(tables.size() / 4),
                                  static_cast<uint32_t>(look.table.size()), e.grid ? ++grids : 0, 0};
        words.insert(words.end(), std::begin(table), std::end(table));
        for (const glm::vec4& entry : look.table) {
            for (int c = 0; c < 4; ++c) tables.push_back(word_of(entry[c]));
        }
    }
    words.insert(words.end(), tables.begin(), tables.end());
    return words;
}

std::vector<uint32_t> words_of_particles(const std::vector<Particle>& particles, const Lattice& lattice) {
    std::vector<uint32_t> words;
    const glm::mat4 to_lattice = lattice.world_to_lattice();
    for (const Particle& p : particles) {
        const glm::vec3 centre(to_lattice * glm::vec4(p.centre, 1));
        // From lattice space to that of the noise.
        const glm::quat turn = p.to_noise * glm::quat_cast(glm::transpose(lattice.turned));
        for (const float value : {centre.x, centre.y, centre.z, p.radius / lattice.voxel, turn.x, turn.y, turn.z,
                                  turn.w, p.displacement, p.age, p.density})
            words.push_back(word_of(value));
        words.push_back(p.emitter);
    }
    return words;
}

float most_density_of(const Emitter& e) {
    const Look& look = e.look;
    float factor = 1;
    if (!look.table.empty()) {
        factor = 0;
        for (const glm::vec4& entry : look.table) factor = std::max(factor, entry.w);
    }
    return factor * std::max(look.density_from, look.density_to) * (e.grid ? e.grid->most : 1);
}

float most_density_of(const std::vector<Emitter>& emitters) {
    float most = 1e-6f;
    for (const Emitter& e : emitters) most = std::max(most, most_density_of(e));
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

}  // namespace lodestone::volume
