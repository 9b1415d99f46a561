// Which pages of one atlas' positions are there, and which of them a cut may use.
//
// A page is usable iff it is there, its parent is, and so are the parent's neighbours across the sides that the page
// has in common with it: then for every sample a cut may take, it may take the sample's parents too, also those that
// lie in pages next door or across a chart's border. A sample on a page's border needs the pages on both sides.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/leaves/leaf_demands.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/pages.h"
#include "vgi/draw/corners/corner_tree.h"

namespace lodestone::vgi {

// A sample as cuts and shaders read it (shaders/shared/vgi_texels.h).
struct GeometryTexel {
    uint16_t x, y, z;
    uint8_t error, radius;
    bool operator==(const GeometryTexel&) const = default;
};
static_assert(sizeof(GeometryTexel) == 8);
// A leaf as a sample: where it is wanted is told alike.
inline GeometryTexel texel_of(const Leaf& leaf) {
    return {leaf.position[0], leaf.position[1], leaf.position[2], leaf.error, leaf.radius};
}
using GeometryPage = std::vector<GeometryTexel>;  // row by row, samples_per_side^2

GeometryPage packed_geometry(const Page& page, const PageTree& tree);
Page unpacked_geometry(const GeometryPage& page);

// What is known of a page that is not there, and that it is.
enum class PageState : uint8_t {
    absent,
    requested,  // asked for, not read yet
    decoding,   // read; being decoded, or decoded and without a slot yet
    failed,     // could not be read or decoded; asked for again later
    resident,
};

// What never changes of the pages of one atlas' positions: which lie side by side, what is below each, and what stands
// above the coarsest.
class PageTopology {
public:
    // about: only its description and gluing are used; must outlive this. leaves: whether its leaves are known here.
    explicit PageTopology(const Atlas& about, bool leaves = true);

    const Atlas& about() const { return *about_; }
    const PageTree& tree() const { return tree_; }
    const CornerTree& corners() const { return corners_; }
    uint32_t pages() const { return static_cast<uint32_t>(neighbours_.size()); }  // of all charts
    // The page across a side (as of charts: 0 at y = 0, then counter-clockwise) at the same level; ~0 where the surface
    // ends.
    uint32_t neighbour(uint32_t number, uint32_t side) const { return neighbours_[number][side]; }
    // Of all samples that a page or a finer one of its part of the chart has, and its parent has not.
    SampleCodes below(uint32_t number) const { return below_[number]; }
    // number is not of a coarsest page.
    uint32_t parent(uint32_t number) const {
        const uint32_t page = number % tree_.pages();
        return number - page + tree_.parent(page);
    }

    // The square of leaves that a page has, into Atlas::leaves; ~0 of pages that are not a chart's finest.
    uint32_t square(uint32_t number) const { return square_.empty() ? ~0u : square_[number]; }
    // The same where there is a leaf in it; else ~0.
    uint32_t leaf(uint32_t number) const {
        const uint32_t its = square(number);
        return its != ~0u && about_->has_leaf(its) ? its : ~0u;
    }
    uint32_t leaf_parts() const { return static_cast<uint32_t>(leaf_of_part_.size()); }  // of all leaves
    // The page in whose square a leaf is, and a part's leaf.
    uint32_t page_of_leaf(uint32_t leaf) const { return page_of_leaf_[leaf]; }
    uint32_t leaf_of_part(uint32_t part) const { return leaf_of_part_[part]; }
    // What there is where leaves are known here.
    const LeafNeighbours& leaf_neighbours() const { return leaf_neighbours_; }
    const LeafDemands& leaf_demands() const { return leaf_demands_; }
    const SamplesBesideLeaves& beside_leaves() const { return beside_leaves_; }
    const SampleDepths& depths() const { return depths_; }
    // Of all leaves in a page's part of the chart.
    SampleCodes leaves_below(uint32_t number) const {
        return leaves_below_.empty() ? SampleCodes{} : leaves_below_[number];
    }

private:
    void place_leaves();

    const Atlas* about_;
    PageTree tree_;
    CornerTree corners_;
    std::vector<std::array<uint32_t, 4>> neighbours_;
    std::vector<SampleCodes> below_;
    std::vector<uint32_t> square_;  // per page; empty where there are no leaves, as are all below
    std::vector<SampleCodes> leaves_below_;
    std::vector<uint32_t> page_of_leaf_, leaf_of_part_;
    LeafNeighbours leaf_neighbours_;
    LeafDemands leaf_demands_;
    SamplesBesideLeaves beside_leaves_;
    SampleDepths depths_;
};

// A part of a leaf as it is drawn: its vertices as shaders read them (LODE_VGI_LEAVES).
struct DrawnLeafPart {
    LeafPart part;
    std::vector<std::array<uint32_t, 4>> words;
    std::vector<PageBounds> runs;  // leaf_runs()
};
// number: of all parts. samples: of the page in whose square it is. uvs: PoolWords::leaf_uvs.
DrawnLeafPart packed_leaf(const PageTopology& topology, uint32_t number, LeafPart part, const GeometryPage& samples,
                          bool uvs);

class Residency {
public:
    explicit Residency(std::shared_ptr<const PageTopology> topology);
    // about: must outlive this.
    explicit Residency(const Atlas& about) : Residency(std::make_shared<const PageTopology>(about)) {}

    const PageTopology& topology() const { return *topology_; }
    const Atlas& about() const { return topology_->about(); }
    const PageTree& tree() const { return topology_->tree(); }
    uint32_t pages() const { return static_cast<uint32_t>(entries_.size()); }  // of all charts
    uint32_t number(uint32_t chart, uint32_t page) const { return chart * tree().pages() + page; }
    uint32_t neighbour(uint32_t number, uint32_t side) const { return topology_->neighbour(number, side); }
    SampleCodes below(uint32_t number) const { return topology_->below(number); }

    struct Entry {
        std::shared_ptr<const GeometryPage> texels;  // null: not there
        const GeometryTexel* first = nullptr;        // of them
        uint32_t slot = ~0u;
        uint8_t usable = 0;  // bit 0: usable itself; bit 1 + side: and so is what is across that side, or nothing is
        PageState state = PageState::absent;
        bool leaf_there = false;  // all parts of the leaf in its square are
        // Whether that leaf can be drawn: all around can draw the samples that lie on its sides.
        bool leaf_usable() const { return leaf_there && usable == 0x1f; }
    };
    const Entry& entry(uint32_t number) const { return entries_[number]; }
    bool usable(uint32_t number) const { return (entries_[number].usable & 1) != 0; }
    bool holds(uint32_t number) const { return entries_[number].texels != nullptr; }

    struct LeafEntry {
        std::shared_ptr<const DrawnLeafPart> part;  // null: not there
        uint32_t slot = ~0u;
        PageState state = PageState::absent;
    };
    // part: 0 .. PageTopology::leaf_parts() - 1.
    const LeafEntry& leaf_part(uint32_t part) const { return parts_[part]; }
    bool holds_leaf_part(uint32_t part) const { return parts_[part].part != nullptr; }
    void put_leaf_part(uint32_t part, std::shared_ptr<const DrawnLeafPart> drawn, uint32_t slot);
    void drop_leaf_part(uint32_t part);
    // Of a part that is not there; not PageState::resident.
    void set_leaf_state(uint32_t part, PageState state);
    // What a cut may ask for or use: pages, then parts of leaves.
    uint32_t units() const { return pages() + static_cast<uint32_t>(parts_.size()); }

    void put(uint32_t number, std::shared_ptr<const GeometryPage> texels, uint32_t slot);
    void drop(uint32_t number);
    // Of a page that is not there; not PageState::resident.
    void set_state(uint32_t number, PageState state);
    // Which pages are usable now: looks at pages that came or went since the last call, and those that follow from
    // them.
    void update();
    bool owes_update() const { return !came_or_went_.empty() || !leaves_changed_.empty(); }
    // How many times update() found anything changed, and how many it was when an entry last changed that a cut reads
    // of the page, of those next to it or of finer ones of its part of the chart.
    uint64_t updates() const { return updates_; }
    uint64_t changed_at(uint32_t number) const { return changed_at_[number]; }

    // Every page's usable bits are what its definition says, unless update() is owed.
    Result<void> validate() const;

private:
    bool usable_by_definition(uint32_t number) const;
    uint8_t usable_bits(uint32_t number) const;
    std::vector<uint32_t> spread_usable();
    void mark_changed(uint32_t number);
    void leaf_part_changed(uint32_t part);
    bool all_parts_there(uint32_t leaf) const;

    std::shared_ptr<const PageTopology> topology_;
    std::vector<Entry> entries_;
    std::vector<LeafEntry> parts_;
    std::vector<uint32_t> came_or_went_;    // since update()
    std::vector<uint32_t> leaves_changed_;  // since then: those of which parts came or went
    std::vector<uint64_t> changed_at_;
    uint64_t updates_ = 0;
};

}  // namespace lodestone::vgi
