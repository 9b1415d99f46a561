// What never changes of an atlas' forest of corners while it is drawn (vgi/asset/corners.h): which triangles there can
// be where only the first corners are wanted.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/error_codes.h"

namespace lodestone::vgi {

// The box around places of corners.
class CornerBox {
public:
    void add(const Corner& corner) {
        const glm::vec3 at(corner.position[0], corner.position[1], corner.position[2]);
        low_ = glm::min(low_, at);
        high_ = glm::max(high_, at);
    }
    // A sphere that holds it, without a cone; of one place at least.
    PageBounds sphere(const Atlas& about) const;

private:
    glm::vec3 low_{65535}, high_{0};  // lattice units
};

// The atlas' part of the table of corners (LODE_VGI_CORNERS): its corners, then its charts.
// coarsest: attributes, as in mip_tail.h, the four corners of each chart at their coarsest level, chart after chart.
using CornerRecord = std::array<uint32_t, 4>;
std::vector<CornerRecord> corner_table(const Atlas& about, std::span<const std::array<uint32_t, 4>> coarsest);

class CornerTree {
public:
    CornerTree() = default;
    // Corners and charts of `about` are used.
    explicit CornerTree(const Atlas& about);

    // Of atlases without a forest, or with too many charts for one (LODE_VGI_CORNER).
    bool empty() const { return faces_.empty(); }
    // Around all corners.
    const PageBounds& bounds() const { return bounds_; }

    // One of the two triangles of a chart.
    struct Face {
        uint32_t chart;
        bool upper;
        // Its corner i, 0 .. 2, as a corner of the chart.
        uint32_t corner(uint32_t i) const { return i == 0 ? 0 : upper ? i + 1 : i; }
    };
    // The first of the charts' corners, 4 * chart + k, that is this corner.
    uint32_t of_chart(uint32_t corner) const { return of_charts_[corner]; }
    // The most there is from the last of those corners on without which no chart has all of its own: none has them
    // where none of these may be wanted. Nothing where all corners of some chart always are.
    std::optional<SampleCodes> most_of_whole() const {
        if (first_whole_ <= roots_) return std::nullopt;
        return most_from_[first_whole_ - 1 - roots_];
    }
    // Those that may have an area where only the first `wanted` corners are wanted.
    std::span<const Face> faces(uint32_t wanted) const {
        const auto end = std::ranges::upper_bound(births_, wanted);
        return std::span(faces_).first(static_cast<size_t>(end - births_.begin()));
    }
    // The first corner from which on none may be wanted; roots, which come first, always are. may_be(SampleCodes): of
    // the most there is from a corner on; false for less where it is for more.
    template <class MayBe>
    uint32_t first_not(MayBe&& may_be) const {
        const auto at = std::ranges::partition_point(most_from_, may_be);
        return roots_ + static_cast<uint32_t>(at - most_from_.begin());
    }

private:
    PageBounds bounds_;
    uint32_t roots_ = 0, first_whole_ = ~0u;  // how many of the first corners some chart needs to have all of its own
    std::vector<SampleCodes> most_from_;      // per corner behind the roots: of it and those after it
    std::vector<uint32_t> of_charts_;         // per corner
    std::vector<uint32_t> births_;            // per face, rising: with how many corners it may have an area
    std::vector<Face> faces_;
};

}  // namespace lodestone::vgi
