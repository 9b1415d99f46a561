// Pages of attributes that are there, as shaders read them, and which of them a view needs.
#pragma once

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
AttributePage packed_attributes(const Page& page, const PageTree& tree, const AtlasAttributes& attributes,
                                uint32_t texel_words);
Page unpacked_attributes(const AttributePage& packed, const PageTree& tree, const AtlasAttributes& attributes);

// Object units between neighbouring samples of the attributes of a chart, level 0, on the average; from its coarsest
// page of positions.
float spacing_of(const Atlas& about, const GeometryPage& coarsest);

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

    // What views[0] needs for samples to be a pixel apart, of the charts named: marks pages that are there as touched;
    // asks for those that are not, by the pixels between samples of what is there instead.
    // spacing: per chart, object units between samples of level 0 (spacing_of).
    void want(const Atlas& about, std::span<const float> spacing, const CutRequest& request,
              std::span<const uint32_t> charts, PageDemand& demand) const;

private:
    PageTree tree_;
    std::vector<Entry> entries_;
};

}  // namespace lodestone::vgi
