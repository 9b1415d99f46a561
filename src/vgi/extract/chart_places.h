// Where the charts of an atlas lie in a texture: squares side by side, a texel for each sample of attributes, and a
// gutter around each.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <vector>

#include "base/result.h"
#include "vgi/asset/atlas.h"

namespace lodestone::vgi {

// Of the same atlas in one texture, or in several of equal layout.
class ChartPlaces {
public:
    static constexpr uint32_t gutter = 4;  // texels between charts; half as many at the texture's sides

    // The finest images of charts, or coarser ones, as many levels as it takes for all to fit into a square of so many
    // texels a side. Fault::usage, without the option's name, where the coarsest pages do not.
    static Result<ChartPlaces> fit(const Atlas& atlas, uint32_t most_texels);

    glm::uvec2 texels() const { return texels_; }        // of the texture, across and down
    uint32_t levels_left_out() const { return shift_; }  // the finest ones of images of attributes; 0: none
    // The texel of a chart's sample (0, 0).
    glm::uvec2 corner(uint32_t chart) const { return corners_[chart]; }
    // Per side of a chart's image there.
    uint32_t cells(uint32_t chart) const { return cells_[chart]; }
    // The level of a chart's own images of attributes that it is.
    uint32_t own_level(uint32_t chart) const { return own_levels_[chart]; }
    // Texture coordinates of a place of a chart, 0 .. 1 each way.
    glm::vec2 uv(uint32_t chart, const glm::dvec2& place) const {
        return (glm::dvec2(corners_[chart]) + 0.5 + place * static_cast<double>(cells_[chart])) / glm::dvec2(texels_);
    }

private:
    ChartPlaces(const Atlas& atlas, uint32_t levels_left_out);
    uint32_t height_at(uint32_t width) const;
    void lay_out(uint32_t width);

    uint32_t shift_ = 0;
    std::vector<uint32_t> own_levels_, cells_, order_;  // order_: charts, largest first
    std::vector<glm::uvec2> corners_;
    glm::uvec2 texels_{0};
};

}  // namespace lodestone::vgi
