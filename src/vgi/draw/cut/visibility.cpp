#include "vgi/draw/cut/visibility.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "base/check.h"
#include "frame/screen_error.h"

namespace lodestone::vgi {

Frustum widened_frustum(const View& view, const CutMargin& margin) {
    if (margin == CutMargin{}) return frustum_of(view);
    View wide = view;
    if (view.kind == View::Kind::camera) {
        wide.view_to_clip[0][0] /= 1 + margin.widening;
        wide.view_to_clip[1][1] /= 1 + margin.widening;
    }
    Frustum frustum = frustum_of(wide);
    for (glm::vec4& plane : frustum.planes()) plane.w += margin.distance;
    // Near and far planes follow the scene.
    frustum.planes()[4].w += 0.1f * view.far_plane;
    frustum.planes()[5].w += 0.5f * view.near_plane;
    return frustum;
}

std::vector<Frustum> widened_frusta(std::span<const View> views, const CutMargin& margin, bool casters_alone) {
    std::vector<Frustum> wide;
    for (const View& view : views) wide.push_back(widened_frustum(view, margin));
    if (casters_alone) keep_casters(views, wide);
    return wide;
}

Visibility::Visibility(const CutRequest& request, const Atlas& about) : about_(&about) {
    if (request.distance) return;
    const glm::mat4 to_object = glm::inverse(request.object_to_world);
    uint32_t open = 0;  // sides, counted without a branch: it is asked for every instance
    for (const GluedSide& side : about.sides) open += side.chart == ~0u ? 1u : 0u;
    cones_ = request.cull_back_faces && open == 0 && glm::determinant(glm::mat3(request.object_to_world)) > 0;
    eye_ = glm::vec3(to_object * glm::vec4(request.views[0].eye, 1));
    scale_ = largest_scale(request.object_to_world);
    eye_margin_ = request.margin.distance * largest_scale(to_object);
    frusta_ = widened_frusta(request.views, request.margin, request.casters_alone);
    for (Frustum& frustum : frusta_) {
        for (glm::vec4& plane : frustum.planes()) {
            plane = plane * request.object_to_world;  // a row vector times the matrix: the plane pulled back
            const float length = glm::length(glm::vec3(plane));
            if (length > 0) plane /= length;
        }
    }
}

uint32_t Visibility::seen(uint32_t mask, const PageBounds& bounds) const {
    for (uint32_t v = 0; v < frusta_.size(); ++v) {
        const auto outside = [&](const glm::vec4& p) {
            const glm::vec3& c = bounds.centre;
            return gpu::lode_outside(p.x, p.y, p.z, p.w, c.x, c.y, c.z, bounds.radius);
        };
        if ((mask >> v & 1) != 0 && std::ranges::any_of(frusta_[v].planes(), outside)) mask &= ~(1u << v);
    }
    if ((mask & 1) != 0 && cones_ && bounds.cosine > 0 && turned_away(bounds)) mask &= ~1u;
    return mask;
}

uint32_t Visibility::seen(uint32_t mask, const PageBounds& bounds, Slack& slack) const {
    const glm::vec3& c = bounds.centre;
    const float away = glm::distance(c, eye_);
    // A view sees it for as long as no plane has it outside, and does not for as long as one does.
    for (uint32_t v = 0; v < frusta_.size(); ++v) {
        if ((mask >> v & 1) == 0) continue;
        float least = std::numeric_limits<float>::infinity();
        bool outside = false;
        for (const glm::vec4& p : frusta_[v].planes()) {
            least = std::min(least, glm::dot(glm::vec3(p), c) + p.w + bounds.radius);
            outside = outside || gpu::lode_outside(p.x, p.y, p.z, p.w, c.x, c.y, c.z, bounds.radius);
        }
        if (outside) mask &= ~(1u << v);
        slack.add(std::abs(least) * scale_, away * scale_);
    }
    if ((mask & 1) != 0 && cones_ && bounds.cosine > 0) {
        const gpu::VgiCutPage page = cut_page_of(bounds, {});
        const glm::vec3 off = c - eye_;
        const float along = glm::dot(glm::vec3(page.axis_x, page.axis_y, page.axis_z), off);
        const float across = std::sqrt(std::max(0.0f, glm::dot(off, off) - along * along));
        const float turned = along * page.cosine - across * std::sqrt(page.sine_squared);
        slack.add(std::abs(turned - bounds.radius - eye_margin_) * scale_, away * scale_);
        if (turned_away(bounds)) mask &= ~1u;
    }
    return mask;
}

std::optional<Motion> Visibility::since(const Visibility& before) const {
    if (frusta_.size() != before.frusta_.size() || cones_ != before.cones_ || scale_ != before.scale_)
        return std::nullopt;
    float distance = glm::distance(eye_, before.eye_) + std::abs(eye_margin_ - before.eye_margin_), angle = 0;
    float largest = glm::length(before.eye_);
    for (size_t v = 0; v < frusta_.size(); ++v) {
        const auto is = frusta_[v].planes(), was = before.frusta_[v].planes();
        if (is.size() != was.size()) return std::nullopt;
        for (size_t k = 0; k < is.size(); ++k) {
            const glm::vec4 &now = is[k], &then = was[k];
            const glm::vec4 at(before.eye_, 1);
            distance = std::max(distance, std::abs(glm::dot(now, at) - glm::dot(then, at)));
            angle = std::max(angle, glm::distance(glm::vec3(now), glm::vec3(then)));
            largest = std::max(largest, std::abs(now.w));
        }
    }
    // What is rounded on the way.
    distance += 2e-6f * largest;
    angle += 2e-6f;
    if (!std::isfinite(distance) || !std::isfinite(angle)) return std::nullopt;
    return Motion{distance * scale_, angle};
}

gpu::VgiCutPage cut_page_of(const PageBounds& bounds, SampleCodes below) {
    gpu::VgiCutPage page{};
    page.centre_x = bounds.centre.x;
    page.centre_y = bounds.centre.y;
    page.centre_z = bounds.centre.z;
    page.radius = bounds.radius;
    page.codes = bounds.sample_error | uint32_t{bounds.sample_radius} << 8 | uint32_t{below.error} << 16 |
                 uint32_t{below.radius} << 24;
    if (bounds.cosine <= 0) return page;
    const glm::vec3 axis = glm::normalize(glm::vec3(bounds.axis[0], bounds.axis[1], bounds.axis[2]));
    page.axis_x = axis.x;
    page.axis_y = axis.y;
    page.axis_z = axis.z;
    page.cosine = static_cast<float>(bounds.cosine) / 127;
    page.sine_squared = 1 - page.cosine * page.cosine;
    return page;
}

bool Visibility::turned_away(const PageBounds& bounds) const {
    const gpu::VgiCutPage p = cut_page_of(bounds, {});
    return gpu::lode_turned_away(p.axis_x, p.axis_y, p.axis_z, p.cosine, p.sine_squared, p.centre_x - eye_.x,
                                 p.centre_y - eye_.y, p.centre_z - eye_.z, p.radius + eye_margin_);
}

void Visibility::describe(gpu::VgiCutInstance& instance) const {
    LODE_CHECK(eye_margin_ == 0 && frusta_.size() <= LODE_CUT_VIEWS, eye_margin_, frusta_.size());
    instance.eye_x = eye_.x;
    instance.eye_y = eye_.y;
    instance.eye_z = eye_.z;
    instance.views = all();
    instance.cones = cones_ ? 1 : 0;
    float* to = instance.planes;
    for (const Frustum& frustum : frusta_) {
        for (const glm::vec4& plane : frustum.planes().first(Frustum::view_planes)) {
            for (int k = 0; k < 4; ++k) *to++ = plane[k];
        }
    }
}

}  // namespace lodestone::vgi
