#include "vgi/cut.h"

#include <algorithm>
#include <glm/matrix.hpp>

#include "base/check.h"
#include "frame/screen_error.h"
#include "vgi/sample_errors.h"
#include "vgi/visibility.h"

namespace lodestone::vgi {

double magnification_of(const View& view, double pixel_error) {
    LODE_CHECK(view.focal_px > 0 && pixel_error > 0, view.focal_px, pixel_error);
    return std::max(least_magnification, static_cast<double>(view.focal_px) / pixel_error);
}

Wanted::Wanted(const CutRequest& request, const Atlas& about) {
    const View& view = request.sets_levels();
    scale_ = largest_scale(request.object_to_world);
    margin_ = request.margin.distance;
    to_world_ = request.object_to_world;
    eye_ = view.eye;
    const auto magnification = static_cast<float>(magnification_of(view, request.pixel_error));
    const ErrorCodes codes(about.extent());
    for (size_t code = 0; code < 256; ++code) {
        errors_[code] = codes.error(static_cast<uint8_t>(code)) * magnification * scale_;
        // A sample without error is wanted by no eye, however near.
        reach_[code] = errors_[code] > 0 ? errors_[code] + request.margin.distance : 0;
        radii_[code] = codes.radius(static_cast<uint8_t>(code)) * scale_;
    }
    // Lattice to world, seen from the eye.
    const glm::dmat4 to_world(request.object_to_world);
    lattice_ = glm::mat3(glm::dmat3(to_world) * about.step);
    offset_ = glm::vec3(glm::dvec3(to_world * glm::dvec4(about.origin, 1)) - glm::dvec3(view.eye));
}

float Wanted::excess(const PageBounds& bounds, SampleCodes most) const {
    const float away = glm::distance(glm::vec3(to_world_ * glm::vec4(bounds.centre, 1)), eye_) -
                       bounds.radius * scale_ - radii_[most.radius] - margin_;
    const float error = errors_[most.error];
    return error > 0 ? error / std::max(away, 1e-3f * error) : 0;
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
        const float excess = wanted.excess(residency.about().bounds[number]);
        if (excess > 1 && visibility.seen(1, number) != 0)
            foreseen[number] = std::max(foreseen[number], std::min(excess * 1e-3f, 1e-2f));
    }
}

}  // namespace lodestone::vgi
