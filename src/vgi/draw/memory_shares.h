// How the memory of a backend is shared out: what atlases need together before anything is drawn, what is left for
// finer pages, leaves and lists of triangles, and what lies where in the pools.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/draw/open_atlas.h"
#include "vgi/draw/pages/page_cache.h"
#include "vgi/draw/recipe_layout.h"
#include "vgi/draw/vgi_source.h"

namespace lodestone::vgi {

// Lists of triangles are of whole triangles and whole patches.
inline constexpr uint64_t list_step = 120;  // bytes

// What the assets hold together, and the bytes of a slot, by layer.
struct Totals {
    PoolWords words;
    uint64_t charts = 0;
    std::array<uint64_t, 2> rows{};           // of the page table
    std::array<uint64_t, 2> pages{}, base{};  // in slots of pools: that charts have; of these the coarsest
    std::array<uint64_t, 2> slots_before{};   // before them: room for mip tails and fixed pages
    uint64_t fixed_positions = 0;             // pages
    std::array<uint64_t, 3> slot_bytes{};
    uint64_t leaf_parts = 0;
    uint64_t corner_records = 0;

    // Of a pool, at most: texels of positions are numbered below leaves, words of attributes in 31 bits, slots in 28
    // (LODE_VGI_TABLE).
    uint64_t most_slots(Layer layer) const;
};

// The atlases, each with its places in pools and tables.
std::vector<OpenAtlas> open_atlases(const std::vector<std::shared_ptr<const AtlasFile>>& files,
                                    const VgiOptions& options, Totals& totals);

// How the budget is spent. An eighth of it is for what is drawn, or what the coarsest level of a few instances takes,
// and as much again for what that had before it grew; the rest for pages, halves for each kind unless one needs less.
struct Shares {
    bool tess = false;                                   // patches are drawn
    uint64_t first_list_bytes = 0, most_list_bytes = 0;  // of the draw lists
    uint64_t list_budget = 0;                            // with what they had before
    std::array<PageCache::PoolSpec, 3> pools{};
};
// What it takes where the device cuts; nothing where it does not.
struct DeviceNeeds {
    uint64_t table_bytes = 0, list_bytes = 0;
};
// Fault::machine where there is not even room for what must be there. atlases: how many.
Result<Shares> share_budget(const Totals& totals, size_t atlases, const VgiOptions& options, const DeviceNeeds& device);

// The backend's buffers, in the order of Buffers.
std::vector<BufferSpec> buffers_of(const Totals& totals, const Shares& shares, size_t atlases);

}  // namespace lodestone::vgi
