#include "vgi/draw/corners/corner_front.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

#include "mesh/cache/tipsify.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

namespace {

constexpr uint32_t cache_entries = 16;  // of a vertex cache: few enough for any

// Whether there is anything to look up in a chart but normals.
bool has_places(const Atlas& about) {
    const AtlasAttributes& has = about.attributes;
    return (has.uvs && !about.images.empty()) || has.colours || has.materials || has.surfaces || has.emissions ||
           has.baked;
}

}  // namespace

CornerFront::CornerFront(const CornerTree& tree, const Atlas& about, const RefinementTest& wanted, bool all)
    : CornerFront(tree, about, all || tree.empty() ? 0 : tree.first_not([&](SampleCodes most) {
          return wanted.may_be(tree.bounds(), most);
      }),
                  wanted) {
    all_ = all || tree.empty();
}

CornerFront::Drawn CornerFront::drawn(uint32_t corner) const {
    uint32_t steps = 0;
    for (; corner >= front_.size(); ++steps) corner = about_.corners[corner].parent;
    return {front_[corner].corner, front_[corner].steps + steps};
}

bool CornerFront::is_whole(uint32_t chart) const {
    return all_ || std::ranges::all_of(about_.chart_corners[chart], [&](uint32_t corner) {
               return corner < front_.size() && front_[corner].steps == 0;
           });
}

std::vector<uint32_t> CornerFront::whole_of(std::span<const uint32_t> charts) const {
    std::vector<uint32_t> whole;
    whole.reserve(charts.size());
    std::ranges::copy_if(charts, std::back_inserter(whole), [&](uint32_t chart) { return is_whole(chart); });
    return whole;
}

// Around all places that corners are drawn in on their ways from their parents, which may be on theirs.
PageBounds CornerFront::around(const std::array<uint32_t, 3>& corners, const RefinementTest& wanted) const {
    CornerBox box;
    for (uint32_t corner : corners) {
        for (;; corner = about_.corners[corner].parent) {
            const Corner& c = about_.corners[corner];
            box.add(c);
            Slack slack;
            if (c.parent == corner ||
                wanted.has_arrived({c.position[0], c.position[1], c.position[2], c.error, c.radius}, slack))
                break;
        }
    }
    return box.sphere(about_);
}

template <class Add>
void CornerFront::for_triangles(Add&& add) const {
    if (all_) return;
    for (const CornerTree::Face& face : tree_.faces(static_cast<uint32_t>(front_.size()))) {
        if (is_whole(face.chart)) continue;
        std::array<uint32_t, 3> corners{}, indices{};
        for (uint32_t i = 0; i < 3; ++i) {
            const uint32_t k = face.corner(i);
            const Drawn its = drawn(about_.chart_corners[face.chart][k]);
            corners[i] = its.corner;
            indices[i] = LODE_VGI_CORNER | its.steps * LODE_VGI_CORNER_STEP | (4 * face.chart + k);
        }
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
        add(corners, indices);
    }
}

void CornerFront::add_triangles(const Visibility& visibility, const RefinementTest& wanted, CutParts& parts) const {
    for_triangles([&](const std::array<uint32_t, 3>& corners, const std::array<uint32_t, 3>& indices) {
        const uint32_t mask = visibility.seen(visibility.all(), around(corners, wanted));
        if (mask == 0) return;
        std::vector<uint32_t>& list = parts.list(mask);
        list.insert(list.end(), indices.begin(), indices.end());
    });
}

std::vector<uint32_t> CornerFront::triangles() const {
    const bool by_chart = has_places(about_);
    std::vector<uint32_t> list, numbers(front_.size(), ~0u), vertices;  // numbers: in `vertices`, of corners
    for_triangles([&](const std::array<uint32_t, 3>& corners, const std::array<uint32_t, 3>& indices) {
        if (by_chart) {
            list.insert(list.end(), indices.begin(), indices.end());
            return;
        }
        for (const uint32_t corner : corners) {
            if (numbers[corner] == ~0u) {
                numbers[corner] = static_cast<uint32_t>(vertices.size());
                vertices.push_back(LODE_VGI_CORNER | tree_.of_chart(corner));
            }
            list.push_back(numbers[corner]);
        }
    });
    if (by_chart) return list;
    list = tipsify(list, static_cast<uint32_t>(vertices.size()), cache_entries);
    for (uint32_t& index : list) index = vertices[index];
    return list;
}

}  // namespace lodestone::vgi
