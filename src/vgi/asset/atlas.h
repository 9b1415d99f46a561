// The atlas: charts, each a square geometry image of (2^n + 1)^2 samples, glued along their sides into one surface.
//
//   Gu, Gortler, Hoppe, "Geometry images", SIGGRAPH 2002.
//
// Texel (x, y) of a chart, 0 .. cells, is number y * (cells + 1) + x. Side s runs counter-clockwise seen from outside
// the surface: 0 along y = 0, 1 along x = cells, 2 back along y = cells, 3 back along x = 0. Step k of a side that is
// glued is step cells - k of the other: an integer translation and quarter turns, given by the pair of side numbers.
// Samples of glued sides are equal bit for bit. A coarser level takes every 2^level-th sample, so that holds there too.
//
// Attributes are images of their own over the same square, as fine as positions or finer.
//
// Charts do without finest levels that nothing asks for, those of small components of positions, and those whose
// textures have few texels of attributes: their images have fewer texels, for which a coarse page stands as it does for
// pages that are missing. Charts that are glued leave out the same levels. Among what they have, each has samples of
// its own down to a level of its own; below it the images hold what lies between these (sample_depths.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "base/result.h"
#include "base/structures/byte_lists.h"
#include "mesh/packed_vertices.h"
#include "mesh/tri_mesh.h"

// Virtual geometry images: the atlas, how it is made of a mesh, and how it is drawn.
namespace lodestone::vgi {

// The place `step` along a side, 0 .. length, of a square of that length.
template <class Number>
std::array<Number, 2> on_side(uint32_t side, Number step, Number length) {
    switch (side) {
        case 0:
            return {step, 0};
        case 1:
            return {length, step};
        case 2:
            return {length - step, length};
        default:
            return {0, length - step};
    }
}
// Whether cell (x, y) of a level is halved from its lowest to its highest corner, or else from the corner of highest x
// to that of highest y: diagonals alternate as in the bintree.
inline bool rising_diagonal(uint32_t x, uint32_t y) { return (x + y) % 2 == 0; }
// The triangles of a cell with corners a, b, c, d, counter-clockwise from its lowest; they run the same way.
template <class Corner>
std::array<std::array<Corner, 3>, 2> cell_triangles(bool rising, const Corner& a, const Corner& b, const Corner& c,
                                                    const Corner& d) {
    if (rising) return {{{a, b, c}, {a, c, d}}};
    return {{{a, b, d}, {b, c, d}}};
}

// Normals in two bytes: octahedral coordinates in steps of 1 / 127.
std::array<int8_t, 2> pack_octahedral(const glm::vec3& unit);
// The unit vector that pack_octahedral() packed.
glm::vec3 unpack_octahedral(const std::array<int8_t, 2>& packed);

// The side of another chart, or of the same, on which a side lies.
struct GluedSide {
    uint32_t chart = ~0u;  // ~0 where the surface ends
    uint32_t side = 0;     // 0 .. 3
    bool operator==(const GluedSide&) const = default;
};

// What samples of attributes have.
struct AtlasAttributes : PresentAttributes {
    bool surfaces = false, emissions = false;  // of baked textures: see Atlas
    // Textures of the source are in the atlas: base colours, times those of vertices, are its colours. Materials keep
    // their factors, which go on multiplying. There are no texture coordinates.
    bool baked = false;
    bool mapped_normals = false;  // maps of normals are in the normals
    // 1 .. 100, of what is baked as files hold it, all but materials; 0: without loss.
    uint8_t texture_quality = 0;
    // Likewise, of the finest level of charts that are dense (Atlas::dense).
    uint8_t dense_quality = 0;
    bool operator==(const AtlasAttributes&) const = default;
};

// What is known of a page of positions (pages.h), all levels finer than its own included; object units.
struct PageBounds {
    glm::vec3 centre{0};  // of the sphere around the samples
    float radius = 0;     // the sphere holds every sample of the page's part of the chart
    float error = 0;      // two-sided distance of the page, drawn as a grid, to the source; never less than a child's
    std::array<int8_t, 3> axis{};  // of the cone that holds the normals of all triangles of its bintree; -127 .. 127
    int8_t cosine = -127;          // of the cone's half angle, rounded down; -127: no cone
    // Largest codes (sample_errors.h) of the samples that the page has and its parent has not.
    uint8_t sample_error = 0, sample_radius = 0;
    uint16_t padding = 0;  // 0
    bool operator==(const PageBounds&) const = default;
};
static_assert(sizeof(PageBounds) == 28);

// A corner of charts and what stands for it where it is not wanted (corners.h).
struct Corner {
    std::array<uint16_t, 3> position{};  // lattice point
    uint8_t error = 255, radius = 255;  // codes (error_codes.h); those of roots, which are always wanted, count nothing
    uint32_t parent = 0;                // the number of one before; of a root its own
    bool operator==(const Corner&) const = default;
};
static_assert(sizeof(Corner) == 12);

// What is known of a leaf (leaves.h), the source's triangles in the square of a finest page of a chart.
struct Leaf {
    std::array<uint16_t, 3> position{};  // lattice point in its middle
    // Codes (error_codes.h): what drawing its samples instead is off by, or the leaves across its sides beside these, 0
    // where there is no leaf; and the sphere around its middle that holds all of it.
    uint8_t error = 0, radius = 0;
    uint32_t parts_end = 0;  // its parts are those from the end of the leaf before
    bool operator==(const Leaf&) const = default;
};
static_assert(sizeof(Leaf) == 12);

// The atlas in memory. A value; copies are deep.
struct Atlas {
    uint32_t cells = 128;            // per side of a whole chart's positions, a power of two, 2 .. 4096
    uint32_t attribute_cells = 128;  // per side of its attributes, a power of two, cells .. 4096
    // Per chart: finest levels it does without, of positions and of attributes; lay_out() sets them.
    std::vector<uint8_t> trimmed_levels, trimmed_attribute_levels;
    // Per chart: of the levels it has, the finest ones without samples of their own; lay_out() sets 0. Of positions
    // fewer than a square of leaves has; of attributes 0 where a chart has several pages of them.
    std::vector<uint8_t> unsampled_levels, unsampled_attribute_levels;
    // Per chart, 0 or 1: whether the finest level of attributes has more samples than textures have texels there, so
    // that one may be off by more: what is seen of a texel is the mean of several. The same of glued charts.
    std::vector<uint8_t> dense;
    glm::dvec3 origin{0};             // positions are origin + step * lattice point, one lattice for all charts
    double step = 1;                  // object units, > 0
    glm::vec2 uv_low{0}, uv_step{0};  // texture coordinates are uv_low + uv_step * texel of `uvs`
    AtlasAttributes attributes;       // normals are always there
    std::vector<GluedSide> sides;     // four per chart
    std::vector<uint32_t> cluster;    // per chart: the cluster it is part of
    std::vector<size_t> first_texel{0}, first_attribute_texel{0};  // per chart, and the end; lay_out() sets them
    // Per level: object units, two-sided distance to the source, never decreasing; empty until measured.
    std::vector<float> errors;
    std::vector<PageBounds> bounds;  // per page of positions, chart after chart; empty until measured
    std::vector<Corner> corners;     // roots first, errors never rise; empty until measured: then all are wanted
    std::vector<std::array<uint32_t, 4>> chart_corners;  // per chart: numbers of the corners where its sides begin
    // Per finest page of a chart's own, row by row, chart after chart; empty: the atlas has no leaves.
    std::vector<Leaf> leaves;
    ByteLists leaf_parts;                 // coded (leaves.h); empty where they stay in a file
    uint32_t leaf_shift = 5;              // leaves' lattice has 1 << leaf_shift points for one of the samples', 0 .. 16
    std::vector<uint32_t> first_leaf{0};  // per chart, and the end; lay_out() sets it

    // Per texel, chart after chart.
    std::vector<std::array<uint16_t, 3>> positions;  // lattice points
    std::vector<uint8_t> sample_errors;              // codes of sample_errors.h; zeros until measured
    std::vector<uint8_t> sample_radii;               // codes of the radii of samples (sample_errors.h)
    // Per texel of the attributes, chart after chart: those of the chart's own side of a seam.
    std::vector<std::array<int8_t, 2>> normals;     // octahedral, -127 .. 127; within a degree
    std::vector<std::array<uint16_t, 2>> uvs;       // uv_low + uv_step * texel; empty where the source has none
    std::vector<glm::u8vec4> colours;               // empty where the source has none
    std::vector<std::array<uint8_t, 3>> surfaces;   // occlusion, roughness, metal; empty where none are baked
    std::vector<std::array<uint8_t, 3>> emissions;  // sRGB; empty where none are baked
    std::vector<uint16_t> materials;                // empty where the source has one material

    std::vector<Material> material_table;  // what `materials` refers to
    std::vector<Image> images;             // textures, what materials refer to

    uint32_t charts() const { return static_cast<uint32_t>(cluster.size()); }  // how many there are
    uint32_t levels() const;                                                   // log2(cells) + 1
    // Sets the charts and what they leave out: of each fewer levels than there are of pages (pages.h), and attributes
    // as fine as positions. None of them is dense.
    void lay_out(std::vector<uint8_t> levels_left_out, std::vector<uint8_t> attribute_levels_left_out);
    // Gives the images that `attributes` names their texels.
    void make_room();
    // Per side of a chart's own images.
    uint32_t cells_of(uint32_t chart) const { return cells >> trimmed_levels[chart]; }
    // Per side of a chart's own images of attributes.
    uint32_t attribute_cells_of(uint32_t chart) const { return attribute_cells >> trimmed_attribute_levels[chart]; }
    // Samples of attributes for one of positions, along a side of a chart.
    uint32_t attribute_ratio_of(uint32_t chart) const { return attribute_cells_of(chart) / cells_of(chart); }
    // x, y: 0 .. cells_of(chart).
    size_t texel(uint32_t chart, uint32_t x, uint32_t y) const {
        return first_texel[chart] + size_t{y} * (cells_of(chart) + 1) + x;
    }
    // x, y: 0 .. attribute_cells_of(chart).
    size_t attribute_texel(uint32_t chart, uint32_t x, uint32_t y) const {
        return first_attribute_texel[chart] + size_t{y} * (attribute_cells_of(chart) + 1) + x;
    }
    size_t texels() const { return first_texel.back(); }  // of all charts
    // Of the parts of all leaves before this one, how many there are.
    uint32_t first_part(uint32_t leaf) const { return leaf == 0 ? 0 : leaves[leaf - 1].parts_end; }
    // Whether a leaf has any part.
    bool has_leaf(uint32_t leaf) const { return leaves[leaf].parts_end > first_part(leaf); }
    uint32_t leaf_part_count() const { return leaves.empty() ? 0 : leaves.back().parts_end; }  // of all leaves
    // Squares of leaves along a side of a chart.
    uint32_t leaves_per_side(uint32_t chart) const;
    // The leaf of square (x, y) of a chart.
    uint32_t leaf(uint32_t chart, uint32_t x, uint32_t y) const {
        return first_leaf[chart] + y * leaves_per_side(chart) + x;
    }
    // Where a point of the leaves' lattice is; object units.
    glm::dvec3 leaf_point(const std::array<uint32_t, 3>& p) const {
        return origin + step / (1u << leaf_shift) * glm::dvec3(p[0], p[1], p[2]);
    }
    size_t attribute_texels() const { return first_attribute_texel.back(); }  // of all charts
    // A chart's own level for a level of the atlas.
    uint32_t own_level(uint32_t chart, uint32_t level) const {
        return level > trimmed_levels[chart] ? level - trimmed_levels[chart] : 0u;
    }
    // A square of a chart that is divided into many.
    struct Tile {
        uint32_t chart, x, y;  // x, y: counted in squares
        bool operator==(const Tile&) const = default;
    };
    // The square across a side of square (x, y), where every chart is divided into per_side x per_side: in the chart,
    // or in the one glued to it. Its chart is ~0 where the surface ends.
    Tile across(Tile from, uint32_t side, uint32_t per_side) const;
    // Largest distance there can be: the lattice's diagonal; object units.
    double extent() const { return step * 65535 * 1.7320508075688772; }
    // Where a lattice point is; object units.
    glm::dvec3 lattice_point(const std::array<uint16_t, 3>& p) const {
        return origin + step * glm::dvec3(p[0], p[1], p[2]);
    }
    glm::dvec3 point(size_t texel) const { return lattice_point(positions[texel]); }  // where a texel is; object units
    glm::vec3 position(size_t texel) const { return glm::vec3(point(texel)); }        // the same, rounded to floats
    // The nearest lattice point, 0 .. 65535 each way.
    glm::dvec3 rounded(const glm::dvec3& point) const {
        return glm::clamp(glm::round((point - origin) / step), 0.0, 65535.0);
    }
    glm::vec3 normal(size_t attribute_texel) const;  // unit length
    // Of all charts: those of the bintree of all samples that are there (for_level_triangles()).
    uint64_t triangles_at(uint32_t level) const;

    // The coarsest level whose error is at most `error`; 0 where none is.
    uint32_t level_for_error(double error) const;

    // Sizes, gluing an involution, glued samples equal bit for bit.
    Result<void> validate() const;
    // Of these, what can be told without the images. That corners close follows: around a corner the next chart is that
    // across the side, and the sides are a permutation.
    Result<void> validate_gluing() const;
    // Every square of leaves has samples in it, and attributes fewer only where they are one page.
    Result<void> validate_depths() const;
};

}  // namespace lodestone::vgi
