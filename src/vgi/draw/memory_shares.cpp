#include "vgi/draw/memory_shares.h"

#include <algorithm>

#include "frame/frame_source.h"
#include "vgi/asset/atlas_chunks.h"
#include "vgi/draw/attributes/mip_tail.h"
#include "vgi/draw/cut/vertex_kinds.h"

namespace lodestone::vgi {

namespace {

constexpr uint64_t most_list_bytes = uint64_t{48} << 20;
constexpr uint64_t first_list_bytes = uint64_t{240} << 10;  // what lists have until they need more
constexpr uint64_t most_leaf_slots = LODE_VGI_LEAF_MOVES / LODE_VGI_LEAF_VERTICES;

// Texture coordinates are of use where there is a texture.
uint32_t attributes_read(const Atlas& about) {
    return attributes_of_samples(about.attributes) & ~(about.images.empty() ? uint32_t{LODE_VGI_HAS_UVS} : 0u);
}

uint64_t mip_tail_of(const OpenAtlas& atlas) {
    return uint64_t{atlas.file->about().charts()} * mip_tail_samples(atlas.trees[1].cells_per_page());
}

// Blocks hold no texture coordinates, and without textures there is little to gain.
uint32_t blocks_of(const std::vector<std::shared_ptr<const AtlasFile>>& files) {
    uint32_t blocks = 0;
    for (const auto& file : files) {
        const Atlas& about = file->about();
        if (about.attributes.uvs) return 0;
        if (about.attributes.baked) blocks |= LODE_VGI_IN_BLOCKS;
        const bool opaque = std::ranges::all_of(about.material_table,
                                                [](const Material& m) { return m.alpha_mode == AlphaMode::opaque; });
        if (about.attributes.colours && !opaque) blocks |= LODE_VGI_ALPHA_IN_BLOCKS;
    }
    return (blocks & LODE_VGI_IN_BLOCKS) != 0 ? blocks : 0;
}

uint64_t divided_up(uint64_t number, uint64_t by) { return (number + by - 1) / by; }

// Gives what lies before the slots of pools its places: mip tails, then fixed pages, each at a multiple of its size.
void place_fixed(std::vector<OpenAtlas>& atlases, Totals& totals) {
    uint64_t mip_tail = 0;
    for (OpenAtlas& atlas : atlases) {
        atlas.first_mip_tail = mip_tail;
        mip_tail += mip_tail_of(atlas);
    }
    std::array<uint64_t, 2> end{0, mip_tail * totals.words.of_sample * sizeof(uint32_t)};  // bytes
    for (const Layer layer : both_layers) {
        const size_t l = index_of(layer);
        for (OpenAtlas& atlas : atlases) {
            if (!atlas.is_fixed(layer)) continue;
            const uint64_t size = totals.words.page_bytes(layer, atlas.trees[l].cells_per_page()),
                           first = divided_up(end[l], size);
            atlas.first_fixed[l] = static_cast<uint32_t>(first);
            end[l] = (first + atlas.file->about().charts()) * size;
        }
        totals.slots_before[l] = divided_up(end[l], totals.words.page_bytes(layer, page_cells));
    }
    // Headers of fixed pages come before those of slots.
    for (OpenAtlas& atlas : atlases) {
        if (!atlas.is_fixed(Layer::geometry)) continue;
        atlas.header_shift = static_cast<uint32_t>(totals.fixed_positions) - atlas.first_fixed[0];
        totals.fixed_positions += atlas.file->about().charts();
    }
    for (OpenAtlas& atlas : atlases) {
        if (!atlas.is_fixed(Layer::geometry))
            atlas.header_shift = static_cast<uint32_t>(totals.fixed_positions - totals.slots_before[0]);
    }
}

}  // namespace

uint64_t Totals::most_slots(Layer layer) const {
    const uint64_t all = layer == Layer::geometry
                             ? LODE_VGI_LEAF / LODE_VGI_PAGE_TEXELS(page_cells)
                             : std::min(uint64_t{1} << 28, (uint64_t{1} << 31) / words.of_page(page_cells)) - 1;
    return all - std::min(all, slots_before[index_of(layer)]);
}

std::vector<OpenAtlas> open_atlases(const std::vector<std::shared_ptr<const AtlasFile>>& files,
                                    const VgiOptions& options, Totals& totals) {
    totals.words.ever = options.textures_in_blocks ? blocks_of(files) : 0;
    std::vector<OpenAtlas> atlases;
    for (auto& file : files) {
        const Atlas& about = file->about();
        totals.words.ever |= attributes_read(about);
        totals.words.of_sample = std::max(totals.words.of_sample, attribute_words(about.attributes));
        OpenAtlas atlas;
        atlas.file = file;
        atlas.first_chart = static_cast<uint32_t>(totals.charts);
        totals.charts += about.charts();
        atlas.topology = std::make_shared<const PageTopology>(about, options.leaves);
        atlas.charts = ChartTree(about);
        for (const Layer layer : both_layers) {
            const size_t l = index_of(layer);
            atlas.trees[l] = tree_of(about, layer);
            totals.rows[l] += uint64_t{about.charts()} * atlas.trees[l].pages();
            if (atlas.is_fixed(layer)) continue;
            for (uint32_t c = 0; c < about.charts(); ++c) totals.pages[l] += tree_of(about, layer, c).pages();
            totals.base[l] += about.charts();
        }
        totals.leaf_parts += atlas.topology->leaf_parts();
        totals.corner_records += about.corners.size() + 3 * about.chart_corners.size();
        atlases.push_back(std::move(atlas));
    }
    totals.words.leaf_uvs = (totals.words.ever & LODE_VGI_HAS_UVS) != 0;
    totals.slot_bytes = {totals.words.page_bytes(Layer::geometry, page_cells) + header_bytes,
                         totals.words.page_bytes(Layer::attributes, page_cells),
                         leaf_slot_bytes(totals.words.leaf_block())};
    place_fixed(atlases, totals);
    return atlases;
}

namespace {

// Bytes of the lists of the coarsest level.
uint64_t least_list_bytes(const Totals& totals, const VgiOptions& options, const DeviceNeeds& device, bool tess) {
    // The device's own lists are for whatever may be drawn.
    if (options.raster == Raster::device) return device.list_bytes;
    return totals.charts * std::max(1u, options.instances) * (tess ? LODE_VGI_PATCH_WORDS * sizeof(uint32_t) : 24);
}

// available: bytes beside what there must be of all else.
void share_lists(uint64_t least, uint64_t available, const VgiOptions& options, Shares& shares) {
    const uint64_t most = (shares.tess ? most_list_bytes / 8 : most_list_bytes) / list_step * list_step;
    const uint64_t wanted = std::min({options.resident_bytes / 4, available / 2, 2 * most});
    shares.list_budget = std::max(options.raster == Raster::device ? 0 : wanted / list_step * list_step, least);
    const bool grows =
        options.raster != Raster::device && shares.list_budget / 2 > std::max(least, 2 * first_list_bytes);
    shares.most_list_bytes = grows ? shares.list_budget / 2 / list_step * list_step : shares.list_budget;
    shares.first_list_bytes = grows ? first_list_bytes : shares.most_list_bytes;
}

// Shaders number pages, charts and texels of the pools in 32 bits; each atlas alone is within Limits.
Result<void> check_totals(const Totals& totals) {
    const Limits limits;
    const uint64_t pages = totals.rows[0] + totals.rows[1];
    const auto fits = [&](Layer layer) {
        const uint64_t most = totals.most_slots(layer);
        return most > 0 && totals.base[index_of(layer)] <= most;
    };
    if (totals.charts <= limits.charts && pages <= limits.pages && std::ranges::all_of(both_layers, fits)) return {};
    return fail(Fault::machine, "the atlases have " + std::to_string(totals.charts) + " charts and " +
                                    std::to_string(pages) + " pages together, and shaders number " +
                                    std::to_string(limits.charts) + " and " + std::to_string(limits.pages) +
                                    "; draw fewer assets at once");
}

// A quarter of what is left, at most, is for leaves; only the bintree draws any.
uint64_t most_slots_of_leaves(const Totals& totals, const VgiOptions& options, uint64_t left) {
    return options.raster == Raster::bintree
               ? std::min({totals.leaf_parts, left / 4 / totals.slot_bytes[2], most_leaf_slots})
               : 0;
}

// left: bytes for pages beside the coarsest.
void share_pages(const Totals& totals, const VgiOptions& options, uint64_t left, Shares& shares) {
    const auto &pages = totals.pages, &base = totals.base;
    const auto& slot_bytes = totals.slot_bytes;
    const uint64_t leaves = most_slots_of_leaves(totals, options, left);
    left -= leaves * slot_bytes[2];
    const std::array<uint64_t, 2> more{(pages[0] - base[0]) * slot_bytes[0], (pages[1] - base[1]) * slot_bytes[1]};
    const uint64_t first = std::min(more[0], std::max(left / 2, left - std::min(left, more[1]))),
                   second = std::min(more[1], left - first), spare = left - first - second;
    const auto slots = [&](size_t l, uint64_t bytes, uint64_t most) {
        return std::min(base[l] + bytes / slot_bytes[l], most);
    };
    const std::array<uint64_t, 3> least{base[0], base[1], 0},
        most{slots(0, first, totals.most_slots(Layer::geometry)),
             slots(1, second, totals.most_slots(Layer::attributes)), leaves};
    constexpr std::array names{geometry_pool, attribute_pool, leaf_pool};
    for (size_t l = 0; l < 3; ++l) {
        // Growing takes room for what a pool is beside what it becomes. Where there is none it is whole from the start.
        const bool grows = most[l] * slot_bytes[l] <= spare;
        shares.pools[l] = {names[l], l < 2 ? static_cast<uint32_t>(totals.slots_before[l]) : 0,
                           static_cast<uint32_t>(grows ? least[l] : most[l]), static_cast<uint32_t>(most[l])};
    }
}

}  // namespace

Result<Shares> share_budget(const Totals& totals, size_t atlases, const VgiOptions& options,
                            const DeviceNeeds& device) {
    Shares shares;
    if (auto good = check_totals(totals); !good) return tl::unexpected(good.error());
    shares.tess = options.raster == Raster::tess || options.raster == Raster::device;
    const auto &rows = totals.rows, &base = totals.base;
    const auto& slot_bytes = totals.slot_bytes;
    uint64_t need = totals.slots_before[0] * totals.words.page_bytes(Layer::geometry, page_cells) +
                    totals.fixed_positions * header_bytes + totals.slots_before[1] * slot_bytes[1] +
                    (rows[0] + rows[1] + totals.charts) * sizeof(uint32_t) + atlases * (sizeof(gpu::VgiAsset) + 2048) +
                    totals.corner_records * sizeof(CornerRecord) + device.table_bytes;
    need += base[0] * slot_bytes[0] + base[1] * slot_bytes[1] + slot_bytes[2];
    const uint64_t least_lists = least_list_bytes(totals, options, device, shares.tess);
    if (need + least_lists > options.resident_bytes)
        return over_budget("tables, the coarsest pages and their lists", need + least_lists, options.resident_bytes);
    share_lists(least_lists, options.resident_bytes - need, options, shares);
    share_pages(totals, options, options.resident_bytes - need - shares.list_budget, shares);
    return shares;
}

std::vector<BufferSpec> buffers_of(const Totals& totals, const Shares& shares, size_t atlases) {
    const auto pool = [&](const char* name, size_t l, uint64_t slot_bytes) {
        const PageCache::PoolSpec& spec = shares.pools[l];
        return BufferSpec{name, (uint64_t{spec.first} + spec.slots) * slot_bytes, use_storage,
                          static_cast<uint32_t>(slot_bytes), (uint64_t{spec.first} + spec.most_slots) * slot_bytes};
    };
    return {pool("page pool of positions", 0, totals.words.page_bytes(Layer::geometry, page_cells)),
            {"slots of the page pool", (totals.fixed_positions + shares.pools[0].most_slots) * header_bytes,
             use_storage, header_bytes},
            {"page table", (totals.rows[0] + totals.rows[1]) * sizeof(uint32_t), use_storage, 4},
            pool("page pool of attributes", 1, totals.slot_bytes[1]),
            {"assets", atlases * sizeof(gpu::VgiAsset), use_storage, sizeof(gpu::VgiAsset)},
            {"errors and radii", atlases * 2048, use_storage, 2048},
            {"spacing of samples", totals.charts * sizeof(float), use_storage, 4},
            {"draw lists", shares.first_list_bytes, shares.tess ? use_storage : use_index, 4, shares.most_list_bytes},
            {"corners of charts", std::max<uint64_t>(totals.corner_records, 1) * sizeof(CornerRecord), use_storage,
             sizeof(CornerRecord)},
            {"pool of leaves", std::max<uint64_t>(shares.pools[2].slots, 1) * totals.slot_bytes[2], use_storage,
             static_cast<uint32_t>(totals.slot_bytes[2]),
             std::max<uint64_t>(shares.pools[2].most_slots, 1) * totals.slot_bytes[2]}};
}

}  // namespace lodestone::vgi
