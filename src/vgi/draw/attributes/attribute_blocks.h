// Pages of attributes in about half of the memory: 4 x 4 samples to a block, as block compressed textures have them,
// which shaders read as they are (shaders/shared/vgi_attributes.glsl). What lies along the sides of a page stays as it
// is, so that nothing shows where pages or charts meet. Materials stay what they are; of more than four in a block,
// those that have least of it become another.
//
//   Khronos Data Format Specification 1.3: each number of colours and surfaces as BC4, normals as BC5, emissions as
//   BC1. Numbers always have eight values from end to end, emissions four: smooth colours would show blocks with so
//   few.
//
// Normals are octahedral around the axis of their block: around another than z where directions would be torn apart.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vgi/draw/attributes/attribute_pages.h"

namespace lodestone::vgi {

// How the blocks of a scene are laid out.
struct BlockLayout {
    uint32_t has = 0;           // LODE_VGI_HAS_..., and LODE_VGI_ALPHA_IN_BLOCKS: what blocks have
    uint32_t sample_words = 1;  // of a sample on the sides

    uint32_t block_words() const;
    // Of a page with so many cells along a side.
    uint32_t page_words(uint32_t cells) const;
    // Where the axes of its blocks are, four bits each, and the blocks.
    uint32_t first_axis(uint32_t cells) const;
    uint32_t first_block(uint32_t cells) const;
};

// Words of shaders/shared/vgi_texels.h.
using AttributeBlocks = std::vector<uint32_t>;

// page: of packed_attributes(), layout.sample_words to a sample; without texture coordinates.
AttributeBlocks attribute_blocks(const AttributePage& page, const PageTree& tree, const AtlasAttributes& attributes,
                                 const BlockLayout& layout);

// Where sample (x, y) of a page is.
struct PlaceInBlocks {
    uint32_t word = 0;                      // its first, or its block's, in the page
    uint32_t block = 0, number = in_plain;  // of the page; of the block, 0 .. 15
    static constexpr uint32_t in_plain = ~0u;
};
PlaceInBlocks place_in_blocks(uint32_t cells, uint32_t x, uint32_t y, const BlockLayout& layout);

// A sample of a block; what the layout has not is 0, alpha 255.
struct BlockSample {
    glm::vec3 normal{0};  // of unit length
    uint32_t material = 0;
    uint32_t colour = 0, surface = 0, emission = 0;  // as packed_attributes() packs them
};
BlockSample block_sample(std::span<const uint32_t> block, uint32_t axis, uint32_t number, uint32_t has);

}  // namespace lodestone::vgi
