#include "vgi/draw/corners/corner_tree.h"

#include <glm/geometric.hpp>
#include <tuple>

#include "base/check.h"
#include "mesh/packed_vertices.h"
#include "shaders/shared/vgi_texels.h"

namespace lodestone::vgi {

namespace {

// How many of the first corners have to be wanted for two corners to be drawn in different places; ~0 where they are
// one.
uint32_t apart_from(const std::vector<Corner>& corners, uint32_t a, uint32_t b) {
    if (a == b) return ~0u;
    uint32_t last = 0;
    while (a != b) {
        uint32_t& later = a > b ? a : b;
        if (corners[later].parent == later) return 0;  // roots come first: both are
        last = later;
        later = corners[later].parent;
    }
    return last + 1;
}

}  // namespace

PageBounds CornerBox::sphere(const Atlas& about) const {
    PageBounds bounds;
    bounds.centre = glm::vec3(about.origin + about.step * 0.5 * glm::dvec3(low_ + high_));
    bounds.radius = static_cast<float>(about.step * 0.5001) * glm::length(high_ - low_);
    return bounds;
}

std::vector<CornerRecord> corner_table(const Atlas& about, std::span<const std::array<uint32_t, 4>> coarsest) {
    LODE_CHECK(coarsest.size() == about.charts(), coarsest.size());
    std::vector<glm::vec3> normals(about.corners.size(), glm::vec3(0));
    for (uint32_t c = 0; c < about.charts(); ++c) {
        for (uint32_t k = 0; k < 4; ++k) {
            const uint32_t word = coarsest[c][k];
            normals[about.chart_corners[c][k]] +=
                unpack_octahedral({static_cast<int8_t>(word & 255), static_cast<int8_t>(word >> 8 & 255)});
        }
    }
    std::vector<CornerRecord> table;
    for (size_t i = 0; i < normals.size(); ++i) {
        const Corner& c = about.corners[i];
        const float length = glm::length(normals[i]);
        const auto packed = pack_normal(length > 1e-3f ? normals[i] / length : glm::vec3(0, 0, 1));
        table.push_back({c.position[0] | uint32_t{c.position[1]} << 16,
                         c.position[2] | uint32_t{c.error} << 16 | uint32_t{c.radius} << 24, c.parent,
                         static_cast<uint16_t>(packed[0]) | uint32_t{static_cast<uint16_t>(packed[1])} << 16});
    }
    table.insert(table.end(), about.chart_corners.begin(), about.chart_corners.end());
    return table;
}

CornerTree::CornerTree(const Atlas& about) {
    if (about.corners.empty()) return;
    CornerBox box;
    for (const Corner& corner : about.corners) box.add(corner);
    bounds_ = box.sphere(about);
    while (roots_ < about.corners.size() && about.corners[roots_].parent == roots_) ++roots_;
    most_from_.resize(about.corners.size() - roots_);
    SampleCodes most;
    for (size_t i = most_from_.size(); i-- > 0;) {
        const Corner& c = about.corners[roots_ + i];
        most = {std::max(most.error, c.error), std::max(most.radius, c.radius)};
        most_from_[i] = most;
    }
    std::vector<std::pair<uint32_t, Face>> born;
    of_charts_.assign(about.corners.size(), ~0u);
    for (uint32_t c = 0; c < about.charts(); ++c) {
        for (uint32_t k = 0; k < 4; ++k) {
            uint32_t& first = of_charts_[about.chart_corners[c][k]];
            first = std::min(first, 4 * c + k);
        }
        first_whole_ = std::min(first_whole_, *std::ranges::max_element(about.chart_corners[c]) + 1);
        for (const bool upper : {false, true}) {
            const Face face{c, upper};
            uint32_t birth = 0;
            for (uint32_t i = 0; i < 3; ++i) {
                birth = std::max(birth, apart_from(about.corners, about.chart_corners[c][face.corner(i)],
                                                   about.chart_corners[c][face.corner((i + 1) % 3)]));
            }
            if (birth != ~0u) born.emplace_back(birth, face);
        }
    }
    std::ranges::stable_sort(born, {}, &std::pair<uint32_t, Face>::first);
    for (const auto& [birth, face] : born) {
        births_.push_back(birth);
        faces_.push_back(face);
    }
}

}  // namespace lodestone::vgi
