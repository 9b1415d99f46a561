// Stage 7 of the atlas: charts sampled on regular grids. The inside by exact integer rasterisation of the flat
// triangles, borders once per arc and copied to both charts.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/images/borders.h"
#include "vgi/bake/images/parameterise.h"

namespace lodestone::vgi {

// What became of the samples of a chart.
struct Sampled {
    uint32_t missing = 0;                   // samples that no triangle covered: none, unless the chart is folded
    uint32_t folded = 0, still_folded = 0;  // cells with a triangle that looks inwards, before and after untangle()
};

// Fills the images of one chart after the other; a chart may be dropped once it is sampled.
class Resampler {
public:
    // The mesh, its normals per wedge, the surface cut into quads and its patches must outlive the sampling.
    // trimmed_levels: Atlas::trimmed_levels.
    Resampler(const TriMesh& mesh, std::span<const glm::vec3> normals, const Surface& surface,
              const ChartComplex& patches, uint32_t cells, uint32_t attribute_cells,
              std::vector<uint8_t> trimmed_levels);

    // Samples of the chart of a quad, 0 .. quads - 1. Different charts may be sampled at once.
    Sampled sample(uint32_t quad, const Chart& chart);

    // The lattice begins with as many steps along the longest extent as 16 bits count; it may be made coarser, to
    // `least_points` at least, before charts are sampled for good. step: object units, taken as far as that allows.
    static constexpr uint32_t most_points = 65535, least_points = 4095;
    void set_step(double step);
    // Of height fields (borders.h): once the lattice is chosen, before charts are sampled for good.
    void keep_corners_open();
    const std::optional<glm::dvec3>& up() const { return up_; }  // of the mesh (untangle.h)
    Atlas take() { return std::move(atlas_); }
    Atlas& atlas() { return atlas_; }

private:
    // x, y: 0 .. attribute_cells_of(chart).
    void put(uint32_t chart, uint32_t x, uint32_t y, const glm::dvec3& position, uint32_t source,
             const CutPlaces::Corners& places, const glm::dvec3& weights);

    const TriMesh& mesh_;
    const std::span<const glm::vec3> normals_;
    const ChartComplex& patches_;
    std::optional<Borders> borders_;
    const std::optional<glm::dvec3> up_;  // of a height field
    double extent_;                       // the longest of the surface
    Atlas atlas_;
};

}  // namespace lodestone::vgi
