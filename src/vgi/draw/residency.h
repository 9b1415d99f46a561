// Which pages of one atlas' positions are there, and which of them a cut may use.
//
// A page is usable iff it is there, its parent is, and so are the parent's neighbours across the sides that the page
// has in common with it: then for every sample a cut may take, it may take the sample's parents too, also those that
// lie in pages next door or across a chart's border. A sample on a page's border needs the pages on both sides.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

// A sample as cuts and shaders read it (shaders/shared/vgi_texels.h).
struct GeometryTexel {
    uint16_t x, y, z;
    uint8_t error, radius;
    bool operator==(const GeometryTexel&) const = default;
};
static_assert(sizeof(GeometryTexel) == 8);
// Of samples: the largest code of their errors, and of their radii (sample_errors.h).
struct SampleCodes {
    uint8_t error = 0, radius = 0;
};
using GeometryPage = std::vector<GeometryTexel>;  // row by row, samples_per_side^2

GeometryPage packed_geometry(const Page& page, const PageTree& tree);
Page unpacked_geometry(const GeometryPage& page);

class Residency {
public:
    // about: only its description and gluing are used; must outlive this.
    explicit Residency(const Atlas& about);

    const Atlas& about() const { return *about_; }
    const PageTree& tree() const { return tree_; }
    uint32_t pages() const { return static_cast<uint32_t>(entries_.size()); }  // of all charts
    uint32_t number(uint32_t chart, uint32_t page) const { return chart * tree_.pages() + page; }

    struct Entry {
        std::shared_ptr<const GeometryPage> texels;  // null: not there
        const GeometryTexel* first = nullptr;        // of them
        uint32_t slot = ~0u;
        uint8_t usable = 0;  // bit 0: usable itself; bit 1 + side: and so is what is across that side, or nothing is
    };
    const Entry& entry(uint32_t number) const { return entries_[number]; }
    bool usable(uint32_t number) const { return (entries_[number].usable & 1) != 0; }

    void put(uint32_t number, std::shared_ptr<const GeometryPage> texels, uint32_t slot);
    void drop(uint32_t number);
    // Which pages are usable now; does nothing where no page came or went since it was last called.
    void update();
    // How many times update() found anything changed, and how many it was when an entry last changed that a cut reads
    // of the page, of those next to it or of finer ones of its part of the chart.
    uint64_t updates() const { return updates_; }
    uint64_t changed_at(uint32_t number) const { return changed_at_[number]; }

    // The page across a side (as of charts: 0 at y = 0, then counter-clockwise) at the same level; ~0 where the surface
    // ends.
    uint32_t neighbour(uint32_t number, uint32_t side) const;

    // Of all samples that a page or a finer one of its part of the chart has, and its parent has not.
    SampleCodes below(uint32_t number) const { return below_[number]; }

    // Every page's usable bits are what its definition says, unless update() is owed.
    Result<void> validate() const;

private:
    bool usable_by_definition(uint32_t number) const;
    void mark_changed(uint32_t number);

    const Atlas* about_;
    PageTree tree_;
    std::vector<Entry> entries_;
    std::vector<std::array<uint32_t, 4>> neighbours_;
    std::vector<SampleCodes> below_;
    std::vector<uint32_t> came_or_went_;  // since update()
    std::vector<uint64_t> changed_at_;
    uint64_t updates_ = 0;
};

}  // namespace lodestone::vgi
