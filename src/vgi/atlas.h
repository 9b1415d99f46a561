// The atlas: charts, each a square geometry image of (2^n + 1)^2 samples, glued along their sides into one surface.
//
//   Gu, Gortler, Hoppe, "Geometry images", SIGGRAPH 2002.
//
// Texel (x, y) of a chart, 0 .. cells, is number y * (cells + 1) + x. Side s runs counter-clockwise seen from outside
// the surface: 0 along y = 0, 1 along x = cells, 2 back along y = cells, 3 back along x = 0. Step k of a side that is
// glued is step cells - k of the other: an integer translation and quarter turns, given by the pair of side numbers.
// Samples of glued sides are equal bit for bit. A coarser level takes every 2^level-th sample, so that holds there too.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "base/result.h"
#include "mesh/packed_vertices.h"
#include "mesh/tri_mesh.h"

namespace lodestone::vgi {

struct GluedSide {
    uint32_t chart = ~0u;  // ~0 where the surface ends
    uint32_t side = 0;     // 0 .. 3
    bool operator==(const GluedSide&) const = default;
};

struct Atlas {
    uint32_t cells = 128;  // per side of a chart, a power of two, 1 .. 4096
    glm::dvec3 origin{0};  // positions are origin + step * lattice point, one lattice for all charts
    double step = 1;       // object units, > 0
    glm::vec2 uv_low{0}, uv_step{0};
    PresentAttributes attributes;   // of the source; normals are always there
    std::vector<GluedSide> sides;   // four per chart
    std::vector<uint32_t> cluster;  // per chart: the cluster it is part of
    // Per level: object units, two-sided distance to the source, never decreasing; empty until measured.
    std::vector<float> errors;

    // Per texel, chart after chart. Attributes are those of the chart's own side of a seam.
    std::vector<std::array<uint16_t, 3>> positions;  // lattice points
    std::vector<std::array<int8_t, 2>> normals;      // octahedral, -127 .. 127; within a degree
    std::vector<std::array<uint16_t, 2>> uvs;        // uv_low + uv_step * texel; empty where the source has none
    std::vector<glm::u8vec4> colours;                // empty where the source has none
    std::vector<uint16_t> materials;                 // empty where the source has one material

    std::vector<Material> material_table;
    std::vector<Image> images;

    uint32_t charts() const { return static_cast<uint32_t>(cluster.size()); }
    uint32_t levels() const;  // log2(cells) + 1
    uint32_t texels_per_chart() const { return (cells + 1) * (cells + 1); }
    size_t texel(uint32_t chart, uint32_t x, uint32_t y) const {
        return size_t{chart} * texels_per_chart() + size_t{y} * (cells + 1) + x;
    }
    // Texel at step 0 .. cells of a side.
    size_t side_texel(uint32_t chart, uint32_t side, uint32_t step_of_side) const;
    glm::vec3 position(size_t texel) const;
    glm::vec3 normal(size_t texel) const;  // unit length
    // 2 * charts * (cells >> level)^2
    uint64_t triangles_at(uint32_t level) const { return uint64_t{2} * charts() * (cells >> level) * (cells >> level); }

    // The coarsest level whose error is at most `error`; 0 where none is.
    uint32_t level_for_error(double error) const;
    // The finest level of at most this many triangles; the last where none is.
    uint32_t level_for_triangles(uint64_t triangles) const;

    // A level as one mesh: glued samples are one vertex; wedges where attributes differ. Diagonals alternate.
    // level: 0 (finest) .. levels() - 1.
    TriMesh extract(uint32_t level) const;

    // Sizes, gluing an involution, glued samples equal bit for bit, corners that close.
    Result<void> validate() const;
};

}  // namespace lodestone::vgi
