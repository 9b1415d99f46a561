#include "vgi/draw/corners/distant_cuts.h"

#include <glm/geometric.hpp>
#include <limits>

#include "frame/screen_error.h"
#include "vgi/draw/corners/corner_front.h"

namespace lodestone::vgi {

namespace {

constexpr double rounded = 1e-5;  // of distances, what float arithmetic may lose on the way, as a share

// Whether there is anything to look up in a chart but normals, which corners have of their own.
bool has_places(const AtlasAttributes& has) {
    return has.uvs || has.colours || has.materials || has.surfaces || has.emissions || has.baked;
}

}  // namespace

InstanceDistance::InstanceDistance(const View& view, const CutMargin& margin)
    : away_(view, margin.turn), to_view_(turned_ahead(view)), eye_(view.eye), margin_(margin.distance) {}

double InstanceDistance::nearest(const glm::mat4& object_to_world, const PageBounds& around) const {
    const double scale = largest_scale(object_to_world);
    const glm::dvec3 centre(glm::dmat4(object_to_world) * glm::dvec4(around.centre, 1));
    const glm::vec3 seen = to_view_ * (centre - eye_);
    // What counts changes no faster than a point moves.
    const double away = double{away_.of(seen)} - rounded * double{glm::length(seen)} - margin_;
    return away / scale - (1 + rounded) * double{around.radius};
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
        at->second = front.triangles(has_places(about_->attributes));
    }
    return at->second;
}

}  // namespace lodestone::vgi
