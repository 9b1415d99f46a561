// The images of an atlas as pages: what is read, decoded and cached as one. A page is 32 x 32 cells of one chart at one
// level, its outer samples included (fewer where the chart has fewer cells). Every page but a chart's coarsest is coded
// as what its parent page cannot tell: samples the parent has are left out, the others are differences from what their
// neighbours let expect. Of averaged channels the parent has means (page_means.h), and all samples are coded. The four
// children of a page are compressed together: they are mostly wanted together, and a page alone is so small that code
// tables would take a sixth of it.
//
// Geometry (positions, errors and radii for the cut) and attributes (normals, texture coordinates, colours, materials)
// are images of their own, each with its own number of cells and its own pages.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

inline constexpr uint32_t page_cells = 32;  // along a side of a page

// Pages of a chart's image, coarsest level first, row by row within a level.
struct PageTree {
    uint32_t cells;  // of the chart's image
    // Finest levels without samples of their own (Atlas::unsampled_levels), of the chart's own.
    uint32_t unsampled = 0;

    // Of the coarsest page: every so manieth sample is one of its own, the others lie between.
    uint32_t base_stride() const { return unsampled > base_level() ? 1u << (unsampled - base_level()) : 1u; }
    uint32_t cells_per_page() const { return cells < page_cells ? cells : page_cells; }  // along a side
    uint32_t samples_per_side() const { return cells_per_page() + 1; }                   // of a page
    // Level of the coarsest pages: one per chart; coarser levels are samples of these.
    uint32_t base_level() const;
    // Pages along a side of a level, 0 .. base_level().
    uint32_t pages_per_side(uint32_t level) const { return (cells >> level) / cells_per_page(); }
    uint32_t pages() const;  // of all levels
    // Its number; `shift`: log2 of the pages along a side of its level, before which (4^shift - 1) / 3 pages come.
    static uint32_t page_of(uint32_t shift, uint32_t x, uint32_t y) {
        return ((1u << (2 * shift)) - 1) / 3 + (y << shift) + x;
    }
    // The number of page (x, y) of a level, 0 .. base_level().
    uint32_t page(uint32_t level, uint32_t x, uint32_t y) const { return page_of(base_level() - level, x, y); }
    void place(uint32_t page, uint32_t* level, uint32_t* x, uint32_t* y) const;  // the inverse of page()
    uint32_t level(uint32_t page) const;                                         // 0 .. base_level()
    uint32_t parent(uint32_t page) const;                                        // page is not 0

    // What is compressed as one: the coarsest page (family 0), and the four children of page p (family p + 1).
    uint32_t families() const { return 1 + (pages() - 1) / 4; }
    // The family that a page is compressed in.
    uint32_t family(uint32_t page) const { return page == 0 ? 0 : parent(page) + 1; }
    // Whether any page of a family has samples that its parent has not; without, nothing is stored of it.
    bool has_samples(uint32_t family) const { return family == 0 || level(member(family, 0)) >= unsampled; }
    // Of the samples of its own that the coarsest page has.
    PageTree sampled_base() const { return {cells_per_page() / base_stride()}; }
    static uint32_t members(uint32_t family) { return family == 0 ? 1 : 4; }  // how many pages it has
    uint32_t member(uint32_t family, uint32_t k) const;                       // page number; k < members(family)
};

// Which images.
enum class Layer : uint8_t {
    geometry,    // positions, sample errors, sample radii
    attributes,  // normals, texture coordinates, colours, materials
    leaves,      // no images: parts of leaves (leaves.h)
};

// Numbers of one sample, each up to 16 bits. Channels of a group have like statistics and are packed together.
struct Channel {
    // What the numbers are, and so what predicts them.
    enum class Kind : uint8_t {
        amount,     // of something: values between two are between them
        smooth,     // an amount with more slope than noise
        direction,  // the same, of which two are one direction, octahedral
        name,       // of a thing: the mean of two is neither
        // Of geometry alone (sample_errors.h): not above that of the sample's parents in the bintree; mostly that of
        // the sphere around the triangles that the sample splits.
        error,
        radius,  // of geometry alone, the same for sample radii
    };
    uint8_t group;             // channels of equal groups stand together
    bool wide;                 // 16 bits, else 8
    bool is_signed;            // numbers of 8 bits are -128 .. 127, else 0 .. 255
    Kind kind = Kind::amount;  // of all its numbers
    bool averaged = false;     // coarser pages have means of what is around instead (page_means.h); not wide
    bool srgb = false;         // means are of the light that the numbers stand for; three such stand together
    // Sixteenths: samples may be off by about half of it (codec/lossy_family.h); 0: they are coded without loss. The
    // other is of the finest level, which is larger where the chart is dense; steps of coarser levels are parts of the
    // first.
    uint32_t step = 0, finest_step = 0;

    // level: of the chart's own; 0 is the finest. Coarser levels have a quarter of the samples each, and are what is
    // seen of a texture most of the time.
    uint32_t step_of(uint32_t level) const {
        constexpr uint32_t most_halvings = 3, least = 64;
        return level == 0 ? finest_step : std::max(step >> std::min(level, most_halvings), std::min(step, least));
    }
};
// The channels of a layer, in the order they are stored.
// Geometry: x, y, z of the lattice; error and radius (sample_errors.h). Attributes: the normal's two, then texture
// coordinates (2), colour (4), material (1), each where the atlas has them. dense: of charts that are (Atlas::dense).
std::vector<Channel> channels_of(const AtlasAttributes& attributes, Layer layer, bool dense = false);
// Of charts that leave out nothing; the pages of one that does are the first of them.
PageTree tree_of(const Atlas& atlas, Layer layer);
PageTree tree_of(const Atlas& atlas, Layer layer, uint32_t chart);  // its own
// Of a chart's coarsest page of positions; of an atlas whose bounds are there.
inline const PageBounds& coarsest_bounds(const Atlas& atlas, uint32_t chart) {
    return atlas.bounds[size_t{chart} * tree_of(atlas, Layer::geometry).pages()];
}

// One page's samples: channel after channel, row by row.
struct Page {
    std::vector<uint16_t> values;  // channels * samples_per_side()^2 of them
};
// The samples of a page, read from the images.
// page: of the chart's own. Its samples, of averaged channels too.
Page read_page(const Atlas& atlas, Layer layer, uint32_t chart, uint32_t page);
// Puts the samples of a page into the images; coarser pages share some of them.
void write_page(Atlas& atlas, Layer layer, uint32_t chart, uint32_t page, const Page& samples);

// All of a chart's pages as they are stored, by number.
std::vector<Page> read_pages(const Atlas& atlas, Layer layer, uint32_t chart);

}  // namespace lodestone::vgi
