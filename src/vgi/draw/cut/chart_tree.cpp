#include "vgi/draw/cut/chart_tree.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>
#include <string>

#include "vgi/asset/pages.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

namespace {

// Bounds of some charts' coarsest pages. A cone is kept where all of them have one and it stays narrower than a half
// space.
PageBounds around(const Atlas& about, std::span<const uint32_t> charts) {
    PageBounds all;
    glm::vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    glm::dvec3 axes(0);
    bool cones = true;
    for (const uint32_t chart : charts) {
        const PageBounds& b = coarsest_bounds(about, chart);
        low = glm::min(low, b.centre - b.radius);
        high = glm::max(high, b.centre + b.radius);
        cones = cones && b.cosine > 0;
        if (cones) axes += glm::normalize(glm::dvec3(b.axis[0], b.axis[1], b.axis[2]));
    }
    all.centre = (low + high) * 0.5f;
    for (const uint32_t chart : charts) {
        const PageBounds& b = coarsest_bounds(about, chart);
        // Rounded up a little.
        all.radius = std::max(all.radius, (glm::distance(all.centre, b.centre) + b.radius) * 1.00001f);
    }
    if (!cones || glm::length(axes) < 1e-3) return all;
    const glm::dvec3 axis = glm::round(glm::normalize(axes) * 127.0);
    if (axis == glm::dvec3(0)) return all;
    const glm::dvec3 unit = glm::normalize(axis);
    double widest = 0;
    for (const uint32_t chart : charts) {
        const PageBounds& b = coarsest_bounds(about, chart);
        const glm::dvec3 own = glm::normalize(glm::dvec3(b.axis[0], b.axis[1], b.axis[2]));
        const double between = std::acos(std::clamp(glm::dot(unit, own), -1.0, 1.0));
        widest = std::max(widest, between + std::acos(static_cast<double>(b.cosine) / 127));
    }
    const double cosine = std::floor(std::cos(widest + 1e-6) * 127);
    if (widest >= 1.57 || cosine <= 0) return all;
    for (int k = 0; k < 3; ++k) all.axis[static_cast<size_t>(k)] = static_cast<int8_t>(axis[k]);
    all.cosine = static_cast<int8_t>(cosine);
    return all;
}

}  // namespace

ChartTree::ChartTree(const Atlas& about) {
    std::vector<glm::vec3> centres;
    for (uint32_t chart = 0; chart < about.charts(); ++chart) centres.push_back(coarsest_bounds(about, chart).centre);
    tree_ = HalvedTree(centres);
    for (const HalvedTree::Node& node : tree_.nodes()) around_.push_back(around(about, tree_.below(node)));
}

std::vector<uint32_t> ChartTree::seen(const Visibility& visibility, const Atlas& about) const {
    const uint32_t per_chart = tree_of(about, Layer::geometry).pages();
    std::vector<uint32_t> found;
    tree_.visit(
        visibility.all(), [&](uint32_t node, uint32_t views) { return visibility.seen(views, around_[node]); },
        [&](uint32_t chart, uint32_t views) { return visibility.seen(views, chart * per_chart); },
        [&](uint32_t chart, uint32_t) { found.push_back(chart); });
    return found;
}

Result<void> ChartTree::validate(const Atlas& about) const {
    std::vector<bool> met(about.charts(), false);
    for (size_t n = 0; n < around_.size(); ++n) {
        for (const uint32_t chart : tree_.below(tree_.nodes()[n])) {
            const PageBounds& b = coarsest_bounds(about, chart);
            if (glm::distance(b.centre, around_[n].centre) + b.radius > around_[n].radius * 1.0001f)
                return fail(Fault::invariant, "chart tree: chart " + std::to_string(chart) + " sticks out of a node");
            met[chart] = true;
        }
    }
    const auto missing = std::ranges::find(met, false);
    if (missing == met.end()) return {};
    return fail(Fault::invariant,
                "chart tree: chart " + std::to_string(missing - met.begin()) + " is not below the root");
}

}  // namespace lodestone::vgi
