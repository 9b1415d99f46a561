#include "vgi/draw/cut/refinement_test.h"

#include <glm/matrix.hpp>
#include <numbers>

#include "base/check.h"
#include "frame/screen_error.h"
#include "vgi/asset/error_codes.h"

namespace lodestone::vgi {

double magnification_of(const View& view, double pixel_error) {
    LODE_CHECK(view.focal_px > 0 && pixel_error > 0, view.focal_px, pixel_error);
    return std::max(least_magnification, static_cast<double>(view.focal_px) / pixel_error);
}

float distance_metric(const View& view, const glm::vec3& world) {
    const float corner = view.corner_cosine(), cosine = 2 * corner * corner - 1;
    const glm::vec3 seen = world - view.eye;
    return gpu::lode_distance_metric(glm::dot(seen, view.forward()), glm::length(seen), 1, cosine, 1 - cosine * cosine);
}

CountedDistance::CountedDistance(const View& view, float most_turned) {
    const double turned = most_turned, to_corner = std::acos(std::min(1.0, double{view.corner_cosine()}));
    const double across = std::min(2 * (to_corner + turned), std::numbers::pi);
    turn = most_turned;
    corner = static_cast<float>(to_corner);
    corner_cosine_squared = 1.0001f * view.corner_cosine() * view.corner_cosine();
    most_change = static_cast<float>(
        std::sin(std::min(to_corner + 2 * std::max(turned, double{most_turn}), std::numbers::pi / 2)));
    ahead = static_cast<float>(std::max(0.0, std::cos(turned) - std::sin(turned) * std::tan(to_corner)));
    cosine = static_cast<float>(std::cos(across));
    sine_squared = static_cast<float>(std::pow(std::sin(across), 2));
}

RefinementTest::RefinementTest(const CutRequest& request, const Atlas& about)
    : everywhere_(request.distance.has_value()), away_(request.sets_levels(), request.margin.turn) {
    const View& view = request.sets_levels();
    scale_ = largest_scale(request.object_to_world);
    margin_ = request.margin.distance;
    magnification_ = static_cast<float>(magnification_of(view, request.pixel_error));
    const ErrorCodes codes(about.extent());
    for (size_t code = 0; code < 256; ++code) {
        const float error = codes.error(static_cast<uint8_t>(code));
        errors_[code] = gpu::lode_reach(error, magnification_, scale_, 0);
        reach_[code] = gpu::lode_reach(error, magnification_, scale_, margin_);
        radii_[code] = codes.radius(static_cast<uint8_t>(code)) * scale_;
    }
    if (everywhere_) {
        LODE_CHECK(request.object_to_world == glm::mat4(1) && request.margin == CutMargin{});
        lattice_ = object_ = {glm::vec3(0), glm::vec3(0), glm::vec3(0), {0, 0, *request.distance}};
        return;
    }
    const glm::dmat4 to_world(request.object_to_world);
    const glm::dmat3 to_view = turned_ahead(view);
    const auto seen_from_eye = [&](double step, const glm::dvec3& origin) {
        const glm::dmat3 axes = to_view * glm::dmat3(to_world) * step;
        return SeenFromEye{axes[0], axes[1], axes[2],
                           to_view * (glm::dvec3(to_world * glm::dvec4(origin, 1)) - glm::dvec3(view.eye))};
    };
    lattice_ = seen_from_eye(about.step, about.origin);
    object_ = seen_from_eye(1, glm::dvec3(0));
}

float RefinementTest::excess(const PageBounds& bounds) const {
    const glm::vec3 seen = object_.seen(bounds.centre);
    const float away =
        away_.aside(seen, glm::dot(seen, seen)) - spread_of(bounds) - radii_[bounds.sample_radius] - margin_;
    const float error = errors_[bounds.sample_error];
    return error > 0 ? error / std::max(away, 1e-3f * error) : 0;
}

float RefinementTest::excess(const GeometryTexel& t) const {
    const float away = away_.of(place_of(t)) - radii_[t.radius] - margin_, error = errors_[t.error];
    return error > 0 ? error / std::max(away, 1e-3f * error) : 0;
}

void RefinementTest::describe(gpu::VgiCutInstance& instance) const {
    LODE_CHECK(margin_ == 0, margin_);  // and no turn
    const auto put = [](const SeenFromEye& map, float* to) {
        for (const glm::vec3& column : {map.x, map.y, map.z, map.offset}) {
            for (int k = 0; k < 3; ++k) *to++ = column[k];
        }
    };
    put(lattice_, instance.lattice);
    put(object_, instance.object);
    instance.magnification = magnification_;
    instance.ahead = away_.ahead;
    instance.cosine = away_.cosine;
    instance.sine_squared = away_.sine_squared;
    instance.scale = scale_;
}

std::optional<RefinementChange> RefinementChange::between(const RefinementTest& before, const RefinementTest& now) {
    if (now.magnification_ != before.magnification_ || now.scale_ != before.scale_ ||
        now.away_.corner != before.away_.corner || now.away_.most_change != before.away_.most_change ||
        now.everywhere_ != before.everywhere_)
        return std::nullopt;
    RefinementChange since(before, now);
    if (now.everywhere_) {
        since.none_ = true;
        return now.object_.offset == before.object_.offset ? std::optional(since) : std::nullopt;
    }
    // Where a point is seen now is turn * (where it was) + shift.
    const auto axes = [](const RefinementTest::SeenFromEye& map) { return glm::dmat3(map.x, map.y, map.z); };
    const glm::dmat3 turn = axes(now.object_) * glm::inverse(axes(before.object_));
    const glm::dvec3 shift = glm::dvec3(now.object_.offset) - turn * glm::dvec3(before.object_.offset);
    since.seen_ = {static_cast<float>(glm::length(shift)), largest_scale(glm::mat4(glm::mat3(turn - glm::dmat3(1))))};
    // A margin's turn changes what counts in the picture by no more than 1 + tan(corner) times itself, and by no more
    // than twice as much aside.
    const float turned = std::abs(now.away_.turn - before.away_.turn) * (2 + std::tan(now.away_.corner));
    // What is rounded on the way, of coordinates and of squares.
    const auto size = [](const RefinementTest::SeenFromEye& map) {
        return glm::length(map.offset) + 65535 * (glm::length(map.x) + glm::length(map.y) + glm::length(map.z));
    };
    since.rounding_ = 1e-6f * std::max(size(now.lattice_), size(before.lattice_));
    since.motion_ = {since.seen_.distance + std::abs(now.margin_ - before.margin_) + since.rounding_,
                     since.seen_.angle + turned / now.away_.most_change + 1e-5f};
    since.turned_ = since.seen_.angle + 2 * turned;
    const auto depth = [](const RefinementTest& w) {
        return w.away_.ahead * glm::vec3(w.object_.x.z, w.object_.y.z, w.object_.z.z);
    };
    since.in_picture_ = glm::distance(depth(now), depth(before)) / now.scale_;
    const float corner =
        std::min(now.away_.corner + std::max(now.away_.turn, before.away_.turn), std::numbers::pi_v<float> / 2);
    since.picture_sine_ = std::sin(now.away_.corner);
    since.picture_cosine_ = std::cos(now.away_.corner);
    since.sine_ = std::sin(corner);
    since.cosine_ = std::cos(corner);
    if (!std::isfinite(since.motion_.of(1)) || !std::isfinite(since.in_picture_)) return std::nullopt;
    return since;
}

Change RefinementChange::of(const GeometryTexel& t) const {
    if (none_) return {};
    const glm::vec3 was = before_->place_of(t), is = now_->place_of(t);
    const float radius = now_->radii_[t.radius], away = glm::length(was);
    const float slack = rounding_ + 1e-5f * (away + radius);
    // How far within the cone of the picture's corners, or outside it, if the same cone is meant by both.
    const auto aside = [](const glm::vec3& p, float sine, float cosine) {
        return p.z * sine - std::sqrt(p.x * p.x + p.y * p.y) * cosine;
    };
    // The same as the middle of them, but for what slopes have changed.
    float more = 0;
    const float moved = seen_.of(away + radius), least = away - radius - moved;
    if (std::min(aside(was, picture_sine_, picture_cosine_), aside(is, picture_sine_, picture_cosine_)) >
        radius + slack) {
        more = radius * in_picture_;
    } else if (std::max(aside(was, sine_, cosine_), aside(is, sine_, cosine_)) < -(radius + slack) &&
               least > 0.1f * away) {
        // There slopes change by no more than twice the way over the distance.
        more = radius * (turned_ + 2 * moved / least);
    } else {
        const float most = motion_.of(away * now_->away_.most_change + radius);
        return {most, most};
    }
    const float farther = now_->away_.of(is) - before_->away_.of(was) - (now_->margin_ - before_->margin_);
    return {more - farther + slack, more + farther + slack};
}

}  // namespace lodestone::vgi
