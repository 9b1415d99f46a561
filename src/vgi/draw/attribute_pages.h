// Pages of attributes that are there, as shaders read them, and which of them a view needs.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vgi/asset/pages.h"
#include "vgi/draw/cut/cut.h"

namespace lodestone::vgi {

// Words of shaders/shared/vgi_texels.h, row by row; `texel_words` to a sample.
using AttributePage = std::vector<uint32_t>;

uint32_t attribute_words(const PresentAttributes& attributes);  // that a sample needs: 1 .. 3
AttributePage packed_attributes(const Page& page, const PageTree& tree, const PresentAttributes& attributes,
                                uint32_t texel_words);
Page unpacked_attributes(const AttributePage& packed, const PageTree& tree, const PresentAttributes& attributes);

// Object units between neighbouring samples of the attributes of a chart, level 0, on the average; from its coarsest
// page of positions.
float spacing_of(const Atlas& about, const GeometryPage& coarsest);

class AttributePages {
public:
    explicit AttributePages(const Atlas& about);

    uint32_t pages() const { return static_cast<uint32_t>(pages_.size()); }  // of all charts
    bool holds(uint32_t number) const { return pages_[number] != nullptr; }
    void put(uint32_t number, std::shared_ptr<const AttributePage> texels);
    void drop(uint32_t number);
    std::shared_ptr<const AttributePage> texels(uint32_t number) const { return pages_[number]; }  // null: not there

    // What views[0] needs for samples to be a pixel apart: marks pages that are there as touched; wanted of those that
    // are not: pixels between samples of what is there instead.
    // spacing: per chart, object units between samples of level 0 (spacing_of).
    void want(const Atlas& about, std::span<const float> spacing, const CutRequest& request, std::vector<float>& wanted,
              std::vector<uint8_t>& touched) const;

private:
    PageTree tree_;
    std::vector<std::shared_ptr<const AttributePage>> pages_;  // null: not there
};

}  // namespace lodestone::vgi
