// Pages of virtual geometry images as they lie in the pools, declared once for C++ and GLSL.
#ifndef LODESTONE_VGI_TEXELS_H
#define LODESTONE_VGI_TEXELS_H

// A page has so many cells along a side, or as many as there are of charts that have fewer.
#define LODE_VGI_PAGE_CELLS 32u
#define LODE_VGI_PAGE_TEXELS(cells) (((cells) + 1u) * ((cells) + 1u))  // samples of a page
#define LODE_VGI_GEOMETRY_WORDS 2  // per sample: x | y << 16, z | error << 16 | radius << 24
// Per sample of the attributes: normal x | normal y << 8 | material << 16; then texture coordinates u | v << 16, then
// colour, then surface (occlusion, roughness, metal), then emission, each where the asset has it. Or in blocks.

// Where a chart's level of so many times fewer cells than its coarsest page begins among the small ones (level 1 has
// half of the page's cells; vgi/draw/attributes/mip_tail.h): after the (cells / 2 + 1)^2 + (cells / 4 + 1)^2 + .. samples before
// it.
#define LODE_VGI_SMALL_FIRST(cells, level)                                              \
    (((cells) * (cells) - ((cells) >> ((level)-1u)) * ((cells) >> ((level)-1u))) / 3u + \
     2u * ((cells) - ((cells) >> ((level)-1u))) + (level)-1u)

// A page's slot is where it lies in its pool, in pages of its size. Indices of samples: slot of the page times
// LODE_VGI_PAGE_TEXELS, plus the place in it. Or LODE_VGI_CORNER: corner k of a chart, 4 chart + k, and
// LODE_VGI_CORNER_STEP for each parent up the corner is in whose place it is drawn. What tells vertices apart is in the
// lowest bits: vertex caches go by them.
#define LODE_VGI_CORNER 0x80000000u
#define LODE_VGI_CORNER_STEP 0x02000000u
#define LODE_VGI_BOX_OF_CHART 0x80000000u
#define LODE_VGI_BOX_DEPTH 20  // boxes that one is in, at most
#define LODE_VGI_NO_CORNERS 0xffffffffu  // VgiAsset::first_corners_of_charts where none is drawn elsewhere
#define LODE_VGI_CORNER_LEVEL 15u        // that such triangles have in the visibility buffer
// Or LODE_VGI_LEAF: slot of a leaf's part times LODE_VGI_LEAF_VERTICES, plus the vertex in it; with LODE_VGI_LEAF_MOVES
// where some vertex of the part may not have come to its place.
#define LODE_VGI_LEAF 0x40000000u
#define LODE_VGI_LEAF_MOVES 0x20000000u
#define LODE_VGI_LEAF_VERTICES 256
#define LODE_VGI_LEAF_PLACES 8192u    // in a chart, along a side
#define LODE_VGI_LEAF_LEVEL 14u       // that triangles of leaves have in the visibility buffer

// Kinds of vertices that indices name: samples, those in the corner of a page apart, for they may be corners of charts;
// LODE_VGI_LEAF, those that may move apart; LODE_VGI_CORNER. Draws are of triangles of one kind alone or of any, so
// that each costs what it needs.
#define LODE_VGI_KIND_SAMPLES 1u
#define LODE_VGI_KIND_CORNER_SAMPLES 2u
#define LODE_VGI_KIND_LEAVES 4u
#define LODE_VGI_KIND_MOVING_LEAVES 8u
#define LODE_VGI_KIND_CORNERS 16u
#define LODE_VGI_KINDS_OF_LEAVES 12u
#define LODE_VGI_EVERY_KIND 31u

// Bindings of descriptor set 1.
#define LODE_VGI_GEOMETRY 0  // pool of positions
#define LODE_VGI_SLOTS 1     // per page in that pool (VgiAsset::header_shift): chart | level << 28, page x | page y << 16
#define LODE_VGI_TABLE 2  // per page, of positions and then of attributes: slot << 4 | level of the finest page there
#define LODE_VGI_ATTRIBUTES 3  // pool of attributes, small levels before its pages
#define LODE_VGI_ASSETS 4      // VgiAsset records
#define LODE_VGI_CHARTS 6      // float per chart: object units between samples of its attributes, on the average
#define LODE_VGI_CODES 5       // decoded errors and radii: 256 floats each, per asset
#define LODE_VGI_PATCHES 7     // words of patches; where they are drawn
// Four words to each: corners (x | y << 16, z | error << 16 | radius << 24, parent, normal as packSnorm2x16 has
// octahedral coordinates), numbered in their atlas; charts (numbers of their corners); and boxes around charts
// (vgi/draw/corners/chart_boxes.h): low x | high x << 16, y and z likewise, and LODE_VGI_BOX_OF_CHART | chart or the first of
// the two boxes in it, counted from the first of the atlas.
#define LODE_VGI_CORNERS 17
// Of parts of leaves, slot by slot: the leaf as a sample (two words: x | y << 16, z | error << 16 | radius << 24), and
// so the leaves across its four sides, itself where there is none; two words unused. Then blocks of four vertices: four
// words to each, a word to each, and, where some atlas has texture coordinates and an image, another. The four: x | y << 21, y >> 11 |
// z << 10 on the leaves' lattice; place x | place y << 14 | low 4 bits of the chart << 28; normal x | normal y << 8 | the
// chart's other bits << 16. The one says how it comes to its place (vgi/draw/leaves/leaf_morph.h): 1 + side that it lies
// on, or 0 | exponent << 8 | off x << 11 | off y << 18 | off z << 25. The other: u | v << 16, as samples have them.
#define LODE_VGI_LEAVES 18
// Counted in four words. block: of four vertices, with texture coordinates (1) or without (0). Then where a slot begins;
// where a vertex is; and where the morphs of its block are, of which it has that of number % 4; the texture coordinates
// of the block follow them.
#define LODE_VGI_LEAF_BLOCK(uvs) (5u + (uvs))
#define LODE_VGI_LEAF_SLOT_TEXELS(block) (3u + 64u * (block))  // of LODE_VGI_LEAF_VERTICES
#define LODE_VGI_LEAF_HEADER(number, block) (LODE_VGI_LEAF_SLOT_TEXELS(block) * ((number) / 256u))
#define LODE_VGI_LEAF_TEXEL(number, block) ((block) * ((number) >> 2) + ((number)&3u) + 3u * ((number) / 256u) + 3u)
#define LODE_VGI_LEAF_MORPHS(number, block) ((block) * ((number) >> 2) + 3u * ((number) / 256u) + 7u)

// A node of a grid cut as a patch to tessellate: level | log2 of its cells << 4 | levels that the node across side s is
// coarser << (8 + 2 s) | views it is drawn in << 16, a bit each; lowest corner x | y << 16, in finest cells; slots of
// the pages that it lies in, from that of its own level (or the coarsest there is) upwards.
#define LODE_VGI_PATCH_VIEWS 16
#define LODE_VGI_PATCH_SLOTS 8
#define LODE_VGI_PATCH_WORDS 10

// Draw words.
#define LODE_VGI_WORD_ASSET 0
#define LODE_VGI_WORD_MAGNIFICATION 1  // float bits: world units of distance for one of error; 0 does not morph
#define LODE_VGI_WORD_PATCH 2          // patches: word of vertex 0 in their list

// Of what is seen at a pixel (shaders/vgi/visible.frag): the chart; above it the level of attributes whose samples are as
// far apart as pixels there, in eighths from so far below 0 on, or that it is not told.
#define LODE_VGI_CHART_MASK 0x000fffffu
#define LODE_VGI_FIT_SHIFT 20
#define LODE_VGI_FIT_BELOW 32
#define LODE_VGI_ANY_FIT 255u
// Visibility, third word: an instance, and whether it is seen from behind.
#define LODE_VGI_FROM_BEHIND 0x80000000u

// VgiAsset::has.
#define LODE_VGI_HAS_UVS 1
#define LODE_VGI_HAS_COLOURS 2
#define LODE_VGI_HAS_MATERIALS 4
#define LODE_VGI_HAS_SURFACES 8
#define LODE_VGI_HAS_EMISSIONS 16
#define LODE_VGI_BAKED 32           // textures of the source are in it
#define LODE_VGI_MAPPED_NORMALS 64  // and maps of normals are in the normals
#define LODE_VGI_MORE_THAN_NORMALS 95  // any of these but LODE_VGI_BAKED
// Of a scene: its pages of attributes are in blocks; and colours in them have alpha.
#define LODE_VGI_IN_BLOCKS 128
#define LODE_VGI_ALPHA_IN_BLOCKS 256

// Pages of attributes in blocks (vgi/draw/attributes/attribute_blocks.h). First what is along the sides, as samples are, from
// the lowest corner towards +x and around; then four bits for each block, the axis of its normals; then the blocks of 4 x 4
// samples, row by row, those that reach beyond the sides as well. Each has normals in 4 words; then, where `has` says so,
// materials in 3, four of 16 bits each, then two bits for each sample; colours in 6; alpha in 2; surfaces in 6; emissions in 2.
#define LODE_VGI_BLOCKS_ALONG(cells) (((cells) + 2u) / 4u)
#define LODE_VGI_BLOCK_AXES(cells, sample_words) (4u * (cells) * (sample_words))
#define LODE_VGI_BLOCKS(cells, sample_words) \
    (LODE_VGI_BLOCK_AXES(cells, sample_words) + (LODE_VGI_BLOCKS_ALONG(cells) * LODE_VGI_BLOCKS_ALONG(cells) + 7u) / 8u)
#define LODE_VGI_IF_HAS(has, what, words) (((has) & (what)) != 0u ? (words) : 0u)
#define LODE_VGI_BLOCK_MATERIALS 4u
#define LODE_VGI_BLOCK_COLOURS(has) (4u + LODE_VGI_IF_HAS(has, LODE_VGI_HAS_MATERIALS, 3u))
#define LODE_VGI_BLOCK_ALPHA(has) (LODE_VGI_BLOCK_COLOURS(has) + LODE_VGI_IF_HAS(has, LODE_VGI_HAS_COLOURS, 6u))
#define LODE_VGI_BLOCK_SURFACES(has) (LODE_VGI_BLOCK_ALPHA(has) + LODE_VGI_IF_HAS(has, LODE_VGI_ALPHA_IN_BLOCKS, 2u))
#define LODE_VGI_BLOCK_EMISSIONS(has) (LODE_VGI_BLOCK_SURFACES(has) + LODE_VGI_IF_HAS(has, LODE_VGI_HAS_SURFACES, 6u))
#define LODE_VGI_BLOCK_WORDS(has) (LODE_VGI_BLOCK_EMISSIONS(has) + LODE_VGI_IF_HAS(has, LODE_VGI_HAS_EMISSIONS, 2u))

// Specialisation constants of shaders that draw or light.
#define LODE_VGI_OWN_UVS_CONSTANT 1  // 1 where leaves have texture coordinates of their own, else 0
#define LODE_VGI_EVER_CONSTANT 2   // LODE_VGI_HAS_... of any asset of the scene that is drawn with, and LODE_VGI_IN_BLOCKS
#define LODE_VGI_WORDS_CONSTANT 3  // of a sample of attributes

#ifdef __cplusplus
#include <cstdint>
namespace lodestone {
namespace gpu {
using uint = uint32_t;
#endif

// 96 bytes.
struct VgiAsset {
    float origin_x, origin_y, origin_z, step;
    float uv_low_x, uv_low_y, uv_step_x, uv_step_y;
    uint cells;  // of positions per side of a chart
    uint header_shift;  // from a slot of positions to its number in LODE_VGI_SLOTS; wraps around
    uint page_cells;   // of geometry pages: 32, or fewer where charts are smaller
    uint first_chart;  // of the chart table
    uint first_page;   // of positions, in the page table
    uint pages;        // of a chart
    uint first_attribute_page;
    uint attribute_pages;
    uint attribute_cells;   // log2, per side of a chart
    uint has;               // LODE_VGI_HAS_...
    uint first_mip_tail;    // sample of the pool of attributes
    uint attribute_page_words;
    uint first_corner;      // of the table of corners
    uint first_corners_of_charts;
    float leaf_step;  // object units, of the leaves' lattice
    uint first_box;   // of the table of corners: where the boxes of charts begin
};

#ifdef __cplusplus
static_assert(sizeof(VgiAsset) == 96);
}  // namespace gpu
}  // namespace lodestone
#endif

#endif
