// An atlas that is drawn: its file, and which of its pages are there.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "vgi/asset/atlas_chunks.h"
#include "vgi/draw/attribute_pages.h"
#include "vgi/draw/page_table.h"
#include "vgi/draw/residency.h"

namespace lodestone::vgi {

constexpr size_t index_of(Layer layer) { return static_cast<size_t>(layer); }
inline constexpr std::array<Layer, 2> both_layers{Layer::geometry, Layer::attributes};

struct OpenAtlas {
    std::shared_ptr<const AtlasFile> file;
    std::unique_ptr<Residency> residency;
    std::unique_ptr<AttributePages> attributes;
    std::array<PageTree, 2> trees;                  // by layer
    std::vector<PageTable> tables;                  // by layer
    std::array<std::vector<Channel>, 2> channels;   // by layer
    std::array<uint32_t, 2> first{};                // number of its first page among all atlases', by layer
    std::vector<float> spacing;                     // per chart, of attributes (spacing_of)
    std::shared_ptr<const AttributePage> mip_tail;  // mip_tail.h
    uint64_t first_mip_tail = 0;                    // of these, in the pool of attributes
    uint32_t first_chart = 0;                       // among all atlases'

    uint32_t pages(Layer layer) const { return file->about().charts() * trees[index_of(layer)].pages(); }
    bool holds(Layer layer, uint32_t number) const {
        return layer == Layer::geometry ? residency->entry(number).texels != nullptr : attributes->holds(number);
    }
};

}  // namespace lodestone::vgi
