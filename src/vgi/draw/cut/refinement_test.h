// Which samples a pixel error asks for, and how long that holds while eye and instance move.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "shaders/shared/vgi_cut.h"
#include "vgi/asset/saturation.h"
#include "vgi/draw/cut/cut.h"
#include "vgi/draw/cut/slack.h"

namespace lodestone::vgi {

// How long a distance of an error is in a view: a sample of error E and radius r is wanted from within
// scale * (E * magnification + r), world units, by depth (gpu::lode_metric_within). Smaller than wanted errors are
// taken where the atlas asks for it.
double magnification_of(const View& view, double pixel_error);

// How far from the view a point of the world counts to be, as gpu::lode_metric_within has it. World units.
float distance_metric(const View& view, const glm::vec3& world);

// How far away points count to be, as gpu::lode_metric_within has it: as far as the nearest has it of all views that
// look no more than a margin's turn aside.
class CountedDistance {
public:
    CountedDistance(const View& view, float turn);

    // p: seen from the eye, z ahead.
    bool within(float reach, const glm::vec3& p) const {
        return gpu::lode_metric_within(reach, p.x, p.y, p.z, ahead, cosine, sine_squared);
    }
    // Short of the picture's corners: where it is nothing but depth that tells.
    bool in_picture(const glm::vec3& p, float squared) const {
        return p.z > 0 && p.z * p.z > corner_cosine_squared * squared;
    }
    float in_depth(const glm::vec3& p) const { return p.z * ahead; }
    float aside(const glm::vec3& p, float squared) const {
        return gpu::lode_distance_metric(p.z, std::sqrt(squared), ahead, cosine, sine_squared);
    }
    float of(const glm::vec3& p) const {
        const float squared = glm::dot(p, p);
        return in_picture(p, squared) ? in_depth(p) : aside(p, squared);
    }

    float corner, turn;                 // radians: from the middle of the picture to its corners; the margin's
    float corner_cosine_squared;        // a little more
    float ahead, cosine, sine_squared;  // as gpu::lode_metric_within takes them
    // Where the eye turns by an angle, what a point counts to be away changes by that times this times its distance.
    float most_change;
};

// Turns the world so that z is ahead of the view.
inline glm::dmat3 turned_ahead(const View& view) {
    return glm::dmat3(1, 0, 0, 0, 1, 0, 0, 0, -1) * glm::dmat3(view.world_to_view);
}

// Whether a sample is wanted, as a pure function of its texel.
class RefinementTest {
public:
    RefinementTest(const CutRequest& request, const Atlas& about);

    bool operator()(const GeometryTexel& t) const {
        const glm::vec3 p = place_of(t);
        return away_.within(reach_[t.error] + radii_[t.radius], p);
    }
    // How much farther away it may count to be, world units, and is still wanted; it is iff that is more than 0.
    float left_of_reach(const GeometryTexel& t) const {
        const glm::vec3 p = place_of(t);
        const float reach = reach_[t.error] + radii_[t.radius], squared = glm::dot(p, p);
        if (away_.in_picture(p, squared)) return reach - away_.in_depth(p);
        const float left = reach - away_.aside(p, squared);
        return away_.within(reach, p) ? std::max(left, std::numeric_limits<float>::min()) : std::min(left, 0.0f);
    }
    // Whether it is wanted, and how long that holds of anything, wherever it lies.
    bool is_wanted(const GeometryTexel& t, Slack& slack) const {
        const float left = left_of_reach(t);
        slack.add(std::abs(left), glm::length(place_of(t)) * away_.most_change);
        return left > 0;
    }
    // Whether it has come to its place (shaders/shared/vgi_sample.glsl) for every eye of the margin; near the end of
    // its way it may be told to be on it. Of a request for a distance nobody knows.
    bool has_arrived(const GeometryTexel& t, Slack& slack) const {
        constexpr float most_left = 0.98f / static_cast<float>(error_ratio);
        const float left =
            most_left * errors_[t.error] + 0.999f * radii_[t.radius] - glm::length(place_of(t)) - margin_;
        slack.add(std::abs(left), 0);
        return left > 0 && !everywhere_;
    }
    // The same of samples that are not looked at: whether any may be wanted, of the most there can be among them, all
    // within the sphere of `bounds`.
    bool may_be(const PageBounds& bounds, SampleCodes most) const {
        return reach_[most.error] > 0 && away_.within(reach_to(bounds, most), object_.seen(bounds.centre));
    }
    bool may_be(const PageBounds& bounds) const { return may_be(bounds, most_of(bounds)); }
    bool may_be(const PageBounds& bounds, Slack& slack) const {
        if (reach_[bounds.sample_error] > 0) {
            const glm::vec3 p = object_.seen(bounds.centre);
            slack.add(std::abs(reach_to(bounds, most_of(bounds)) - away_.of(p)), glm::length(p) * away_.most_change);
        }
        return may_be(bounds);
    }
    // How many times larger than the pixel error leaving them out would be on screen.
    float excess(const PageBounds& bounds) const;
    // The same of a sample, or of what has its codes.
    float excess(const GeometryTexel& t) const;

    // For a device to tell the same.
    void describe(gpu::VgiCutInstance& instance) const;

private:
    friend class RefinementChange;

    // Where a point is, as gpu::lode_metric_within takes it.
    struct SeenFromEye {
        glm::vec3 x, y, z, offset;
        glm::vec3 seen(const glm::vec3& p) const {
            return {gpu::lode_mapped(offset.x, x.x, y.x, z.x, p.x, p.y, p.z),
                    gpu::lode_mapped(offset.y, x.y, y.y, z.y, p.x, p.y, p.z),
                    gpu::lode_mapped(offset.z, x.z, y.z, z.z, p.x, p.y, p.z)};
        }
    };
    static SampleCodes most_of(const PageBounds& bounds) { return {bounds.sample_error, bounds.sample_radius}; }
    glm::vec3 place_of(const GeometryTexel& t) const { return lattice_.seen(glm::vec3(t.x, t.y, t.z)); }
    // By how much nearer than its centre something in it may count to be.
    float spread_of(const PageBounds& bounds) const { return everywhere_ ? 0 : bounds.radius * scale_; }
    float reach_to(const PageBounds& bounds, SampleCodes most) const {
        return reach_[most.error] + radii_[most.radius] + spread_of(bounds);
    }
    std::array<float, 256> errors_, reach_, radii_;
    float magnification_, scale_, margin_;
    bool everywhere_;  // everything counts to be as far away
    CountedDistance away_;
    SeenFromEye lattice_, object_;
};

// How much what counts has changed between two requests for the same atlas.
class RefinementChange {
public:
    // Nothing where more has changed than where things are. Both must outlive it.
    static std::optional<RefinementChange> between(const RefinementTest& before, const RefinementTest& now);

    // Of all points.
    const Motion& motion() const { return motion_; }
    // Of the sample and those that it is an ancestor of in the bintree: they are within its radius.
    Change of(const GeometryTexel& t) const;

private:
    RefinementChange(const RefinementTest& before, const RefinementTest& now) : before_(&before), now_(&now) {}
    const RefinementTest *before_, *now_;
    bool none_ = false;     // nothing has changed
    Motion motion_;         // of what counts
    Motion seen_;           // of where points are seen
    float turned_ = 0;      // how much the gradient of what counts may have turned, of points in the same place
    float in_picture_ = 0;  // by how much it changed there
    // Of the angle from the middle of the picture to its corners; and of one that no margin's turn reaches.
    float picture_sine_ = 0, picture_cosine_ = 0, sine_ = 0, cosine_ = 0;
    float rounding_ = 0;
};

}  // namespace lodestone::vgi
