// Pages of attributes that are there, as shaders read them, and which of them a view needs.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vgi/asset/pages.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/page_demand.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

// Words of shaders/shared/vgi_texels.h, row by row; `texel_words` to a sample.
using AttributePage = std::vector<uint32_t>;

uint32_t attribute_words(const AtlasAttributes& attributes);  // that a sample needs: 1 .. 5
uint32_t attributes_of_samples(const AtlasAttributes& has);   // VgiAsset::has
// The normal in the first word of a sample.
inline glm::vec3 packed_normal(uint32_t word) {
    return unpack_octahedral({static_cast<int8_t>(word & 255), static_cast<int8_t>(word >> 8 & 255)});
}
AttributePage packed_attributes(const Page& page, const PageTree& tree, const AtlasAttributes& attributes,
                                uint32_t texel_words);
Page unpacked_attributes(const AttributePage& packed, const PageTree& tree, const AtlasAttributes& attributes);

// How far apart neighbouring samples of the attributes of a chart are, level 0, as its coarsest page of positions
// tells; object units.
struct ChartSpacing {
    static constexpr uint32_t splits = 3;
    static constexpr float most_stretch = 8;
    float mean = 0;
    // The way in which they are farthest, where in a part of the chart they are that, but at most most_stretch times
    // the mean: of the whole, its quarters, and so on, numbered as pages are (PageTree::page_of).
    std::array<float, (size_t{1} << 2 * (splits + 1)) / 3> widest{};

    // Of the same parts, as many as there may be pages for: what is in it, by the same samples; cones are wider by as
    // much as what lies between samples may be turned, mostly.
    std::vector<PageBounds> bounds;
    uint32_t bounds_splits = 0;  // at most `splits`

    // Of the part that holds page (x, y) of a level with 1 << shift pages a side.
    float widest_of(uint32_t shift, uint32_t x, uint32_t y) const { return widest[part_of(shift, x, y, splits)]; }
    const PageBounds& bounds_of(uint32_t shift, uint32_t x, uint32_t y) const {
        return bounds[part_of(shift, x, y, bounds_splits)];
    }

private:
    static uint32_t part_of(uint32_t shift, uint32_t x, uint32_t y, uint32_t most) {
        const uint32_t finer = shift - std::min(shift, most);
        return PageTree::page_of(shift - finer, x >> finer, y >> finer);
    }
};
// off: what the page is off by, object units.
ChartSpacing spacing_of(const Atlas& about, const GeometryPage& coarsest, float off);

class AttributePages {
public:
    explicit AttributePages(const Atlas& about);

    struct Entry {
        std::shared_ptr<const AttributePage> texels;  // null: not there
        uint32_t slot = ~0u;
        PageState state = PageState::absent;
    };
    uint32_t pages() const { return static_cast<uint32_t>(entries_.size()); }  // of all charts
    const Entry& entry(uint32_t number) const { return entries_[number]; }
    bool holds(uint32_t number) const { return entries_[number].texels != nullptr; }
    void put(uint32_t number, std::shared_ptr<const AttributePage> texels, uint32_t slot);
    void drop(uint32_t number);
    // Of a page that is not there; not PageState::resident.
    void set_state(uint32_t number, PageState state);

    // What views[0] needs for samples to be 1.4 pixels apart where they are farthest, of the charts named: marks pages
    // that are there as touched; asks for those that are not, by the pixels between samples of what is there instead.
    // Pixels are as in the middle of the picture. spacing: per chart.
    void want(const Atlas& about, std::span<const ChartSpacing> spacing, const CutRequest& request,
              std::span<const uint32_t> charts, PageDemand& demand) const;

private:
    PageTree tree_;
    std::vector<Entry> entries_;
};

}  // namespace lodestone::vgi
