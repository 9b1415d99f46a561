// An atlas that is drawn: what never changes of it while it is.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "vgi/asset/atlas_chunks.h"
#include "vgi/draw/attributes/attribute_pages.h"
#include "vgi/draw/cut/chart_tree.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

constexpr size_t index_of(Layer layer) { return static_cast<size_t>(layer); }
inline constexpr std::array<Layer, 2> both_layers{Layer::geometry, Layer::attributes};  // of images
inline constexpr std::array<Layer, 3> all_layers{Layer::geometry, Layer::attributes, Layer::leaves};

struct OpenAtlas {
    std::shared_ptr<const AtlasFile> file;
    std::shared_ptr<const PageTopology> topology;
    ChartTree charts;
    std::array<PageTree, 2> trees;                  // by layer
    std::array<uint32_t, 3> first{};                // number of its first page or part among all atlases', by layer
    std::vector<ChartSpacing> spacing;              // per chart, of attributes
    std::shared_ptr<const AttributePage> mip_tail;  // mip_tail.h
    uint64_t first_mip_tail = 0;                    // of these, in the pool of attributes
    uint32_t first_chart = 0;                       // among all atlases'
    std::array<uint32_t, 2> first_fixed{};          // by layer, where pages are fixed: the slot of the first chart's
    uint32_t header_shift = 0;                      // VgiAsset::header_shift

    // Whether it has only one page to each chart, smaller than others may be: it is always there, and has a place
    // before the slots of the pool, which it would not fill.
    bool is_fixed(Layer layer) const {
        return layer != Layer::leaves && trees[index_of(layer)].cells_per_page() < page_cells;
    }

    uint32_t pages(Layer layer) const {
        if (layer == Layer::leaves) return topology->leaf_parts();
        return file->about().charts() * trees[index_of(layer)].pages();
    }
};

// All that is known of the pages of one atlas.
struct AtlasPages {
    Residency geometry;
    AttributePages attributes;

    bool holds(Layer layer, uint32_t number) const {
        if (layer == Layer::leaves) return geometry.holds_leaf_part(number);
        return layer == Layer::geometry ? geometry.holds(number) : attributes.holds(number);
    }
    PageState state(Layer layer, uint32_t number) const {
        if (layer == Layer::leaves) return geometry.leaf_part(number).state;
        return layer == Layer::geometry ? geometry.entry(number).state : attributes.entry(number).state;
    }
    uint32_t slot(Layer layer, uint32_t number) const {
        if (layer == Layer::leaves) return geometry.leaf_part(number).slot;
        return layer == Layer::geometry ? geometry.entry(number).slot : attributes.entry(number).slot;
    }
    void set_state(Layer layer, uint32_t number, PageState state) {
        if (layer == Layer::leaves) return geometry.set_leaf_state(number, state);
        layer == Layer::geometry ? geometry.set_state(number, state) : attributes.set_state(number, state);
    }
    void drop(Layer layer, uint32_t number) {
        if (layer == Layer::leaves) return geometry.drop_leaf_part(number);
        layer == Layer::geometry ? geometry.drop(number) : attributes.drop(number);
    }
};

// An atlas and what was known of its pages at some moment: what a cut is made from.
struct AtlasSnapshot {
    const OpenAtlas* atlas = nullptr;
    std::shared_ptr<const AtlasPages> pages;
};

}  // namespace lodestone::vgi
