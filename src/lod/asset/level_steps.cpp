#include "lod/asset/level_steps.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace lodestone {

namespace {

double diagonal_of(std::span<const MeshVertex> vertices) {
    std::vector<glm::vec3> places;
    places.reserve(vertices.size());
    for (const MeshVertex& v : vertices) places.emplace_back(v.position[0], v.position[1], v.position[2]);
    return bounding_box(places).diagonal();
}

}  // namespace

LevelSteps level_steps(const ProgressiveMesh& pm) {
    constexpr uint32_t sweep = 2000, least_triangles = 2000;
    LevelSteps result;
    result.diagonal = diagonal_of(pm.vertices);
    for (uint32_t level = 0; level < pm.levels(); ++level)
        result.distinct_errors += level == 0 || pm.errors[level] != pm.errors[level - 1];
    const auto above_zero = std::ranges::upper_bound(pm.errors, 0.0f);
    if (above_zero == pm.errors.end()) return result;
    uint32_t last = pm.level_for_triangles(least_triangles);
    if (pm.triangles_at(last) <= least_triangles && last > 0) --last;
    const double least = *above_zero, most = pm.errors[last];
    if (most <= least || pm.triangles_at(last) <= least_triangles) return result;
    std::vector<double> steps;
    for (uint32_t i = 0; i < sweep; ++i) {
        const double error = least * std::pow(most / least, static_cast<double>(i) / (sweep - 1));
        const double drawn = pm.triangles_at(pm.level_for_error(error));
        steps.push_back(1 - pm.triangles_at(pm.level_for_error(1.01 * error)) / drawn);
    }
    std::ranges::sort(steps);
    result.largest_step = steps.back();
    result.median_step = steps[steps.size() / 2];
    return result;
}

}  // namespace lodestone
