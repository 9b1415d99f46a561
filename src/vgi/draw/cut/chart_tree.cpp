#include "vgi/draw/cut/chart_tree.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <span>
#include <string>

#include "mesh/tri_mesh.h"
#include "vgi/asset/pages.h"
#include "vgi/draw/cut/visibility.h"

namespace lodestone::vgi {

namespace {

const PageBounds& root_of(const Atlas& about, uint32_t chart) {
    return about.bounds[size_t{chart} * tree_of(about, Layer::geometry).pages()];
}

// Bounds of some charts' coarsest pages. A cone is kept where all of them have one and it stays narrower than a half
// space.
PageBounds around(const Atlas& about, std::span<const uint32_t> charts) {
    PageBounds all;
    glm::vec3 low(std::numeric_limits<float>::max()), high(std::numeric_limits<float>::lowest());
    glm::dvec3 axes(0);
    bool cones = true;
    for (const uint32_t chart : charts) {
        const PageBounds& b = root_of(about, chart);
        low = glm::min(low, b.centre - b.radius);
        high = glm::max(high, b.centre + b.radius);
        cones = cones && b.cosine > 0;
        if (cones) axes += glm::normalize(glm::dvec3(b.axis[0], b.axis[1], b.axis[2]));
    }
    all.centre = (low + high) * 0.5f;
    for (const uint32_t chart : charts) {
        const PageBounds& b = root_of(about, chart);
        // Rounded up a little.
        all.radius = std::max(all.radius, (glm::distance(all.centre, b.centre) + b.radius) * 1.00001f);
    }
    if (!cones || glm::length(axes) < 1e-3) return all;
    const glm::dvec3 axis = glm::round(glm::normalize(axes) * 127.0);
    if (axis == glm::dvec3(0)) return all;
    const glm::dvec3 unit = glm::normalize(axis);
    double widest = 0;
    for (const uint32_t chart : charts) {
        const PageBounds& b = root_of(about, chart);
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

ChartTree::ChartTree(const Atlas& about) : charts_(about.charts()) {
    std::iota(charts_.begin(), charts_.end(), 0u);
    if (!charts_.empty()) build(about);
}

void ChartTree::build(const Atlas& about) {
    nodes_.push_back({{}, 0, static_cast<uint32_t>(charts_.size())});
    for (size_t n = 0; n < nodes_.size(); ++n) {
        const uint32_t first = nodes_[n].first, count = nodes_[n].count;
        const auto own = std::span(charts_).subspan(first, count);
        nodes_[n].bounds = around(about, own);
        if (count <= leaf_charts) continue;
        std::vector<glm::vec3> centres;
        for (const uint32_t chart : own) centres.push_back(root_of(about, chart).centre);
        const int axis = bounding_box(centres).longest_axis();
        const auto middle = own.begin() + count / 2;
        std::ranges::nth_element(own, middle, {},
                                 [&](uint32_t chart) { return std::pair(root_of(about, chart).centre[axis], chart); });
        const auto left = static_cast<uint32_t>(nodes_.size());
        nodes_[n].first = left;
        nodes_[n].count = 0;
        nodes_.push_back({{}, first, count / 2});
        nodes_.push_back({{}, first + count / 2, count - count / 2});
    }
}

std::vector<uint32_t> ChartTree::seen(const Visibility& visibility, const Atlas& about) const {
    std::vector<uint32_t> found;
    if (nodes_.empty()) return found;
    const uint32_t per_chart = tree_of(about, Layer::geometry).pages();
    std::vector<std::pair<uint32_t, uint32_t>> open = {{0, visibility.all()}};  // node, views that may see it
    while (!open.empty()) {
        const auto [number, views] = open.back();
        open.pop_back();
        const Node& node = nodes_[number];
        const uint32_t mask = visibility.seen(views, node.bounds);
        if (mask == 0) continue;
        if (node.count == 0) {
            open.emplace_back(node.first, mask);
            open.emplace_back(node.first + 1, mask);
            continue;
        }
        for (const uint32_t chart : std::span(charts_).subspan(node.first, node.count)) {
            if (visibility.seen(mask, chart * per_chart) != 0) found.push_back(chart);
        }
    }
    std::ranges::sort(found);
    return found;
}

Result<void> ChartTree::validate(const Atlas& about) const {
    std::vector<uint32_t> met(charts_.size(), 0);
    const auto check = [&](const auto& self, uint32_t number) -> Result<std::vector<uint32_t>> {
        const Node& node = nodes_[number];
        std::vector<uint32_t> below;
        if (node.count > 0) {
            below.assign(charts_.begin() + node.first, charts_.begin() + node.first + node.count);
        } else {
            for (const uint32_t child : {node.first, node.first + 1}) {
                auto part = self(self, child);
                if (!part) return part;
                below.insert(below.end(), part->begin(), part->end());
            }
        }
        for (const uint32_t chart : below) {
            const PageBounds& b = root_of(about, chart);
            if (glm::distance(b.centre, node.bounds.centre) + b.radius > node.bounds.radius * 1.0001f)
                return fail(Fault::invariant, "chart tree: chart " + std::to_string(chart) + " sticks out of a node");
        }
        return below;
    };
    if (nodes_.empty()) return {};
    auto all = check(check, 0);
    if (!all) return tl::unexpected(all.error());
    std::ranges::sort(*all);
    for (uint32_t chart = 0; chart < all->size(); ++chart) {
        if ((*all)[chart] != chart || all->size() != about.charts())
            return fail(Fault::invariant, "chart tree: chart " + std::to_string(chart) + " is not below one leaf");
    }
    return {};
}

}  // namespace lodestone::vgi
