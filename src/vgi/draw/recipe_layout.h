// Buffers and pipelines of the backend's recipe by number.
#pragma once

#include <cstdint>

#include "frame/plan.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/draw/attributes/attribute_blocks.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

// Either passes of DeviceCut, from first_pass on, or triangles of one kind alone (vgi/draw/cut/vertex_kinds.h); and what
// lights leaves, where some atlas has leaves and none has more than normals.
enum Pipelines : uint32_t {
    visibility_pipeline,
    lighting_pipeline,
    first_pass,
    samples_pipeline = first_pass,
    any_samples_pipeline,
    corners_pipeline,
    leaves_pipeline,
    moving_leaves_pipeline,
    leaves_lighting_pipeline
};
enum Buffers : uint32_t {
    geometry_pool,
    slot_table,
    page_table,
    attribute_pool,
    asset_table,
    code_table,
    chart_table,
    draw_lists,
    corners_of_charts,
    leaf_pool,
    // Where the device cuts (study/device_cut.h).
    cut_instances,
    cut_bounds,
    cut_sides,
    cut_states,
    cut_leaves,
    cut_records,
    cut_findings,
    cut_lists,
    cut_entries
};
inline constexpr uint32_t header_bytes = 8;  // of a page of positions (LODE_VGI_SLOTS)
static_assert(LODE_VGI_PAGE_CELLS == page_cells);
// leaf_block: LODE_VGI_LEAF_BLOCK.
inline constexpr uint64_t leaf_slot_bytes(uint32_t leaf_block) {
    return uint64_t{LODE_VGI_LEAF_SLOT_TEXELS(leaf_block)} * 16;
}
static_assert(LODE_VGI_LEAF_SLOT_TEXELS(5u) == LODE_VGI_LEAF_MORPHS(LODE_VGI_LEAF_VERTICES - 1, 5u) + 1 &&
              LODE_VGI_LEAF_SLOT_TEXELS(6u) == LODE_VGI_LEAF_MORPHS(LODE_VGI_LEAF_VERTICES - 1, 6u) + 2);

// How the pools of a scene hold attributes.
struct PoolWords {
    uint32_t of_sample = 1;
    uint32_t ever = 0;      // LODE_VGI_HAS_... that some atlas has and shaders read; LODE_VGI_IN_BLOCKS
    bool leaf_uvs = false;  // whether vertices of leaves have texture coordinates

    bool in_blocks() const { return (ever & LODE_VGI_IN_BLOCKS) != 0; }
    BlockLayout blocks() const { return {ever, of_sample}; }
    // Of a page of attributes of so many cells along a side.
    uint32_t of_page(uint32_t cells) const {
        return in_blocks() ? blocks().page_words(cells) : LODE_VGI_PAGE_TEXELS(cells) * of_sample;
    }
    // Of a page of either, in bytes.
    uint64_t page_bytes(Layer layer, uint32_t cells) const {
        return layer == Layer::geometry ? uint64_t{LODE_VGI_PAGE_TEXELS(cells)} * sizeof(GeometryTexel)
                                        : uint64_t{of_page(cells)} * sizeof(uint32_t);
    }
    uint32_t leaf_block() const { return LODE_VGI_LEAF_BLOCK(leaf_uvs ? 1u : 0u); }
};

// Adds an upload to the plan's update stage.
inline void add_upload(Plan& plan, uint32_t buffer, uint64_t offset, Blob blob) {
    plan.stats.uploaded_bytes += blob.size();
    plan.commands.push_back({Stage::update, Upload{buffer, offset, std::move(blob)}});
}

}  // namespace lodestone::vgi
