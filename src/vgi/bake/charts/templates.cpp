#include "vgi/bake/charts/templates.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

namespace {

// Corners are a quarter of the way round apart, give or take; a right angle is worth so much of the whole way.
constexpr double worth_of_angle = 0.15;

// Four of a loop's vertices, in order, the first at its sharpest turn.
std::array<size_t, 4> corners_of(const std::vector<glm::dvec3>& loop) {
    const size_t count = loop.size();
    std::vector<double> turn(count), along(count + 1, 0);
    for (size_t i = 0; i < count; ++i) {
        const glm::dvec3 before = loop[i] - loop[(i + count - 1) % count], after = loop[(i + 1) % count] - loop[i];
        const double lengths = glm::length(before) * glm::length(after);
        const double angle = lengths > 0 ? std::acos(std::clamp(glm::dot(before, after) / lengths, -1.0, 1.0)) : 0;
        turn[i] = std::min(angle / (std::numbers::pi / 2), 1.0);
    }
    const auto first = static_cast<size_t>(std::ranges::max_element(turn) - turn.begin());
    for (size_t i = 0; i < count; ++i)
        along[i + 1] = along[i] + glm::distance(loop[(first + i) % count], loop[(first + i + 1) % count]);
    const double whole = along.back() > 0 ? along.back() : 1;
    // least[j][i]: the lowest cost of corners 1 .. j + 1 that end with vertex i after the first.
    std::array<std::vector<double>, 3> least;
    std::array<std::vector<size_t>, 3> from;
    for (size_t j = 0; j < 3; ++j) {
        least[j].assign(count, std::numeric_limits<double>::infinity());
        from[j].assign(count, 0);
        double best = j == 0 ? 0 : std::numeric_limits<double>::infinity();
        size_t best_at = 0;
        for (size_t i = j + 1; i < count; ++i) {
            if (j > 0 && least[j - 1][i - 1] < best) {
                best = least[j - 1][i - 1];
                best_at = i - 1;
            }
            const double off = std::abs(along[i] / whole - static_cast<double>(j + 1) / 4);
            least[j][i] = best + off - worth_of_angle * turn[(first + i) % count];
            from[j][i] = best_at;
        }
    }
    const auto third = static_cast<size_t>(std::ranges::min_element(least[2]) - least[2].begin());
    const size_t second = from[2][third];
    return {first, (first + from[1][second]) % count, (first + second) % count, (first + third) % count};
}

bool is_disk(const ChartMesh& patch) {
    size_t ends = 0;
    for (const uint32_t g : patch.twin) ends += g == none;
    const size_t edges = (patch.twin.size() + ends) / 2;
    return ends > 0 && patch.positions.size() + patch.triangles.size() == edges + 1;
}

}  // namespace

std::optional<TemplateQuad> disk_template(const Surface& surface, std::span<const uint32_t> triangles) {
    const ChartMesh patch = take_chart_mesh(surface, triangles);
    if (!is_disk(patch)) return std::nullopt;
    const std::vector<uint32_t> boundary = patch.boundary();
    if (boundary.size() < 4) return std::nullopt;
    std::vector<glm::dvec3> loop;
    for (const uint32_t v : boundary) loop.push_back(patch.positions[v]);
    const auto at = corners_of(loop);
    TemplateQuad quad{{triangles.begin(), triangles.end()}, {}};
    for (size_t k = 0; k < 4; ++k) quad.corners[k] = patch.origin[boundary[at[k]]];
    return quad;
}

std::optional<std::array<TemplateQuad, 2>> sphere_template(const Surface& surface, std::span<const uint32_t> triangles,
                                                           std::span<const uint32_t> label) {
    std::set<uint32_t> labels(label.begin(), label.end());
    if (labels.size() != 4) return std::nullopt;
    const std::vector<uint32_t> cluster(labels.begin(), labels.end());
    std::array<glm::dvec3, 4> facing{};
    std::map<uint32_t, std::set<uint32_t>> around;  // of a vertex: clusters
    for (size_t i = 0; i < triangles.size(); ++i) {
        const auto& v = surface.triangles[triangles[i]].vertices;
        const auto c = static_cast<size_t>(std::ranges::find(cluster, label[i]) - cluster.begin());
        facing[c] += area_vector(surface.positions[v[0]], surface.positions[v[1]], surface.positions[v[2]]);
        for (const uint32_t corner : v) around[corner].insert(label[i]);
    }
    size_t partner = 1;  // of the first cluster
    for (const size_t p : {2u, 3u}) {
        if (glm::length(facing[0] + facing[p]) > glm::length(facing[0] + facing[partner])) partner = p;
    }
    std::array<TemplateQuad, 2> quads;
    for (size_t i = 0; i < triangles.size(); ++i)
        quads[label[i] == cluster[0] || label[i] == cluster[partner] ? 0 : 1].triangles.push_back(triangles[i]);
    const ChartMesh patch = take_chart_mesh(surface, quads[0].triangles);
    if (!is_disk(patch)) return std::nullopt;
    std::vector<uint32_t> corners;
    for (const uint32_t v : patch.boundary()) {
        if (around[patch.origin[v]].size() >= 3) corners.push_back(patch.origin[v]);
    }
    if (corners.size() != 4) return std::nullopt;
    quads[0].corners = {corners[0], corners[1], corners[2], corners[3]};
    quads[1].corners = {corners[1], corners[0], corners[3], corners[2]};
    return quads;
}

}  // namespace lodestone::vgi
