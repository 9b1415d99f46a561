// Stage 7 of the atlas: charts sampled on regular grids. The inside by exact integer rasterisation of the flat
// triangles, borders once per arc and copied to both charts.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vgi/asset/atlas.h"
#include "vgi/asset/leaves/leaves.h"
#include "vgi/asset/sample_depths.h"
#include "vgi/bake/charts/chart_complex.h"
#include "vgi/bake/images/baked_looks.h"
#include "vgi/bake/images/borders.h"
#include "vgi/bake/images/chart_sizes.h"
#include "vgi/bake/images/parameterise.h"
#include "vgi/bake/images/untangle.h"

namespace lodestone::vgi {

// What became of the samples of a chart.
struct Sampled {
    uint32_t missing = 0;                   // samples that no triangle covered: none, unless the chart is folded
    uint32_t folded = 0, still_folded = 0;  // cells with a triangle that looks inwards, before and after untangle()
};

// What is sampled. It must outlive the sampling.
struct ResampleInput {
    const TriMesh& mesh;
    std::span<const glm::vec3> normals;  // of the mesh, per wedge
    const Surface& surface;              // cut into quads
    const ChartComplex& patches;         // of the surface
    const BakedLooks* looks = nullptr;   // of the mesh, where its textures are baked into the atlas
};

// What a mesh's samples have, with its textures baked or as they are; looks: null for these.
AtlasAttributes attributes_of_atlas(const TriMesh& mesh, const BakedLooks* looks);

// What a place of a source triangle looks like, as texels of the atlas have it. place: weights of the triangle's
// corners 1 and 2.
TexelAttributes source_attributes(const ResampleInput& input, const Atlas& atlas, uint32_t triangle,
                                  const glm::dvec2& place);

// Fills the images of one chart after the other; a chart may be dropped once it is sampled.
class Resampler {
public:
    Resampler(const ResampleInput& input, ChartSizes positions, ChartSizes attributes);

    // Samples of the chart of a quad, 0 .. quads - 1. Different charts may be sampled at once.
    Sampled sample(uint32_t quad, const Chart& chart);

    // The lattice begins with as many steps along the longest extent as 16 bits count; it may be made coarser, to
    // `least_points` at least, before charts are sampled for good. step: object units, taken as far as that allows.
    static constexpr uint32_t most_points = 65535, least_points = 4095;
    void set_step(double step);
    // Of height fields (borders.h): once the lattice is chosen, before charts are sampled for good.
    void keep_corners_open();
    const std::optional<glm::dvec3>& up() const { return up_; }  // of the mesh (untangle.h)
    const ResampleInput& input() const { return input_; }
    const SampleDepths& depths() const { return depths_; }  // of the atlas
    Atlas take() { return std::move(atlas_); }
    Atlas& atlas() { return atlas_; }
    const Atlas& atlas() const { return atlas_; }

private:
    // One chart while it is sampled.
    struct Sampling {
        uint32_t quad;
        const Chart& chart;
        uint32_t cells, ratio;              // attribute cells of the chart; cells for one of positions
        uint32_t stride, attribute_stride;  // attribute cells between samples of its own: of positions; of attributes
        uint32_t row;                       // positions of its own in a row
        std::vector<SurfaceSample> places;  // of these

        // x_or_y: both coordinates' bits together.
        bool is_sampled(uint32_t x_or_y) const { return x_or_y % stride == 0 || x_or_y % attribute_stride == 0; }
    };
    void set_uv_range();
    void glue_sides();
    void sample_borders(Sampling& s);
    // How many samples no triangle covered.
    uint32_t sample_inside(Sampling& s);
    // x, y: 0 .. attribute_cells_of(chart).
    void put_new(Sampling& s, uint32_t x, uint32_t y, const SurfaceSample& place);
    void put(const Sampling& s, uint32_t x, uint32_t y, const SurfaceSample& place);
    void fill_between(uint32_t quad);
    void put_attributes(const Sampling& s, size_t texel, const SurfaceSample& place);
    double share_per_sample(const Sampling& s, uint32_t triangle) const;

    const ResampleInput input_;
    const ChartComplex& patches_;
    std::optional<Borders> borders_;
    const std::optional<glm::dvec3> up_;  // of a height field
    double extent_;                       // the longest of the surface
    Atlas atlas_;
    SampleDepths depths_;
};

}  // namespace lodestone::vgi
