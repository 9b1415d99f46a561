#include "vgi/cut.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <numbers>

#include "base/check.h"
#include "frame/screen_error.h"
#include "vgi/sample_errors.h"
#include "vgi/visibility.h"

namespace lodestone::vgi {

double magnification_of(const View& view, double pixel_error) {
    LODE_CHECK(view.focal_px > 0 && pixel_error > 0, view.focal_px, pixel_error);
    return std::max(least_magnification, static_cast<double>(view.focal_px) / pixel_error);
}

float counted_distance(const View& view, const glm::vec3& world) {
    const float corner = view.corner_cosine(), cosine = 2 * corner * corner - 1;
    const glm::vec3 seen = world - view.eye;
    return gpu::lode_counted(glm::dot(seen, view.forward()), glm::length(seen), 1, cosine, 1 - cosine * cosine);
}

Wanted::Wanted(const CutRequest& request, const Atlas& about) {
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
    // As far as the nearest of all views has it that look no more than the margin's turn aside.
    const double turn = request.margin.turn, corner = std::acos(std::min(1.0, double{view.corner_cosine()}));
    const double across = std::min(2 * (corner + turn), std::numbers::pi);
    ahead_ = static_cast<float>(std::max(0.0, std::cos(turn) - std::sin(turn) * std::tan(corner)));
    cosine_ = static_cast<float>(std::cos(across));
    sine_squared_ = static_cast<float>(std::pow(std::sin(across), 2));
    const glm::dmat4 to_world(request.object_to_world);
    const glm::dmat3 to_view = glm::dmat3(1, 0, 0, 0, 1, 0, 0, 0, -1) * glm::dmat3(view.world_to_view);
    const auto seen_from_eye = [&](double step, const glm::dvec3& origin) {
        const glm::dmat3 axes = to_view * glm::dmat3(to_world) * step;
        return SeenFromEye{axes[0], axes[1], axes[2],
                           to_view * (glm::dvec3(to_world * glm::dvec4(origin, 1)) - glm::dvec3(view.eye))};
    };
    lattice_ = seen_from_eye(about.step, about.origin);
    object_ = seen_from_eye(1, glm::dvec3(0));
}

float Wanted::excess(const PageBounds& bounds) const {
    const glm::vec3 seen = object_.seen(bounds.centre);
    const float away = gpu::lode_counted(seen.z, glm::length(seen), ahead_, cosine_, sine_squared_) -
                       bounds.radius * scale_ - radii_[bounds.sample_radius] - margin_;
    const float error = errors_[bounds.sample_error];
    return error > 0 ? error / std::max(away, 1e-3f * error) : 0;
}

void Wanted::describe(gpu::VgiCutInstance& instance) const {
    LODE_CHECK(margin_ == 0, margin_);  // and no turn
    const auto put = [](const SeenFromEye& map, float* to) {
        for (const glm::vec3& column : {map.x, map.y, map.z, map.offset}) {
            for (int k = 0; k < 3; ++k) *to++ = column[k];
        }
    };
    put(lattice_, instance.lattice);
    put(object_, instance.object);
    instance.magnification = magnification_;
    instance.ahead = ahead_;
    instance.cosine = cosine_;
    instance.sine_squared = sine_squared_;
    instance.scale = scale_;
}

void CutParts::add(const CutParts& other) {
    for (const auto& [mask, words] : other.parts_) {
        auto& to = list(mask);
        to.insert(to.end(), words.begin(), words.end());
    }
}

std::vector<std::pair<uint32_t, std::vector<uint32_t>>> CutParts::take() {
    std::ranges::sort(parts_, {}, [](const auto& part) { return part.first; });
    return std::move(parts_);
}

void foresee(const Residency& residency, const CutRequest& request, std::span<const float> wanted_now,
             std::vector<float>& foreseen) {
    const Visibility visibility(request, residency.about());
    const Wanted wanted(request, residency.about());
    const uint32_t per_chart = residency.tree().pages();
    for (uint32_t number = 0; number < residency.pages(); ++number) {
        const uint32_t page = number % per_chart;
        if (residency.entry(number).texels != nullptr || wanted_now[number] > 0 ||
            residency.entry(number - page + residency.tree().parent(page)).texels == nullptr)
            continue;
        const PageBounds& bounds = residency.about().bounds[number];
        if (wanted.may_be(bounds) && visibility.seen(1, number) != 0)
            foreseen[number] = std::max(foreseen[number], std::min(wanted.excess(bounds) * 1e-3f, 1e-2f));
    }
}

}  // namespace lodestone::vgi
