#include "vgi/draw/cut/corner_front.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

#include "shaders/shared/vgi_texels.h"
#include "vgi/draw/corner_tree.h"
#include "vgi/draw/cut/refinement_test.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

namespace {

uint32_t count_to_look_at(const CornerTree& tree, const RefinementTest& wanted) {
    return tree.first_not([&](SampleCodes most) { return wanted.may_be(tree.bounds(), most); });
}

}  // namespace

bool any_chart_may_be_whole(const CornerTree& tree, const CutRequest& request, const Atlas& about) {
    return tree.empty() || request.forced_level >= 0 ||
           count_to_look_at(tree, RefinementTest(request, about)) >= tree.first_whole();
}

CornerFront::CornerFront(const CornerTree& tree, const Atlas& about, const RefinementTest& wanted, bool all)
    : tree_(tree), about_(about), all_(all || tree.empty()) {
    if (all_) return;
    const uint32_t count = count_to_look_at(tree, wanted);
    front_.reserve(count);
    for (uint32_t i = 0; i < count; ++i) {
        const Corner& c = about.corners[i];
        const bool is_root = c.parent == i;
        const GeometryTexel texel{c.position[0], c.position[1], c.position[2], c.error, c.radius};
        if (is_root || (front_[c.parent].steps == 0 && wanted(texel))) {
            front_.push_back({i, 0});
        } else {
            front_.push_back({front_[c.parent].corner, front_[c.parent].steps + 1});
        }
    }
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

// Around where the corners are drawn, wherever they are on their way from their parents.
PageBounds CornerFront::around(const std::array<uint32_t, 3>& corners) const {
    CornerBox box;
    for (const uint32_t corner : corners) {
        box.add(about_.corners[corner]);
        box.add(about_.corners[about_.corners[corner].parent]);
    }
    return box.sphere(about_);
}

void CornerFront::add_triangles(const Visibility& visibility, CutParts& parts) const {
    if (all_) return;
    for (const CornerTree::Face& face : tree_.faces(static_cast<uint32_t>(front_.size()))) {
        if (is_whole(face.chart)) continue;
        std::array<uint32_t, 3> corners{}, indices{};
        for (uint32_t i = 0; i < 3; ++i) {
            const uint32_t k = face.corner(i);
            const Drawn its = drawn(about_.chart_corners[face.chart][k]);
            corners[i] = its.corner;
            indices[i] = LODE_VGI_CORNER | (4 * face.chart + k) << LODE_VGI_CORNER_STEPS | its.steps;
        }
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
        const uint32_t mask = visibility.seen(visibility.all(), around(corners));
        if (mask == 0) continue;
        std::vector<uint32_t>& list = parts.list(mask);
        list.insert(list.end(), indices.begin(), indices.end());
    }
}

}  // namespace lodestone::vgi
