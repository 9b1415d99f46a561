// Which triangles of a chart's source lie about a place of its square.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

class PatchBuckets {
public:
    // The square is divided into side x side buckets. patch: flattened; must outlive this.
    PatchBuckets(const ChartMesh& patch, uint32_t side);

    // Squared distance from a point to the nearest triangle in the buckets around the place (x, y) / side, or `most`
    // where that is less: never less than to the whole source. At most `enough` is as good as that.
    double squared_distance(const glm::dvec3& point, uint32_t x, uint32_t y, double most, double enough) const;

private:
    struct Ball {
        glm::dvec3 centre;
        double radius;
    };
    const ChartMesh& patch_;
    const uint32_t side_;
    std::vector<uint32_t> first_, triangles_;  // per bucket, row by row, and the end; those whose boxes meet it
    std::vector<Ball> balls_;                  // around each triangle
};

}  // namespace lodestone::vgi
