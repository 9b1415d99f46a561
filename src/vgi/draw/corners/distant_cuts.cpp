#include "vgi/draw/corners/distant_cuts.h"

#include <glm/geometric.hpp>
#include <limits>

#include "vgi/draw/corners/corner_front.h"

namespace lodestone::vgi {

InstanceDistance::InstanceDistance(const View& view, const CutMargin& margin)
    : away_(view, margin.turn), to_view_(turned_ahead(view)), eye_(view.eye), margin_(margin.distance) {}

double InstanceDistance::nearest(const glm::mat4& object_to_world, const Sphere& around) const {
    const double scale = largest_scale(object_to_world);
    const glm::dvec3 centre(glm::dmat4(object_to_world) * glm::dvec4(around.centre, 1));
    const glm::vec3 seen = to_view_ * (centre - eye_);
    // What counts changes no faster than a point moves.
    const double away = double{away_.of(seen)} - DistantCuts::rounded * double{glm::length(seen)} - margin_;
    return away / scale - (1 + DistantCuts::rounded) * double{around.radius};
}

DistantCuts::DistantCuts(const CornerTree& tree, const Atlas& about)
    : tree_(&tree), about_(&about), codes_(about.extent()), least_(std::numeric_limits<double>::infinity()) {}

double DistantCuts::reach_of(SampleCodes codes) const {
    return (1 + rounded) * (double{codes_.error(codes.error)} * magnification_ + double{codes_.radius(codes.radius)});
}

void DistantCuts::begin(double magnification) {
    if (magnification == magnification_) return;
    magnification_ = magnification;
    made_.clear();
    const std::optional<SampleCodes> whole = tree_->empty() ? std::nullopt : tree_->most_of_whole();
    least_ = whole ? (whole->error > 0 ? reach_of(*whole) : 0) : std::numeric_limits<double>::infinity();
}

const std::vector<uint32_t>& DistantCuts::triangles(int32_t step) {
    const auto [at, is_new] = made_.try_emplace(step);
    if (is_new) {
        const double nearest = reach_of(step);
        // As RefinementTest::may_be and its operator() have it.
        const uint32_t count =
            tree_->first_not([&](SampleCodes most) { return most.error > 0 && reach_of(most) > nearest; });
        const CornerFront front(*tree_, *about_, count, [&](const GeometryTexel& t) {
            return reach_of({t.error, t.radius}) > nearest;
        });
        at->second = front.triangles();
    }
    return at->second;
}

}  // namespace lodestone::vgi
