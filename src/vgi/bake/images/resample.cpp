#include "vgi/bake/images/resample.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "vgi/asset/codec/unsampled_pages.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

namespace {
// Texture coordinates have 14 bits: a quarter of a texel of a 4096^2 texture.
constexpr float most_uv = 16383;
constexpr int64_t fine = int64_t{1} << 18;  // integer steps per cell: edge functions stay below 2^62 up to 4096 cells

using IntegerPoint = std::array<int64_t, 2>;

// Positive where (x, y) is left of the edge from p to q.
int64_t edge(const IntegerPoint& p, const IntegerPoint& q, int64_t x, int64_t y) {
    return (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
}

// Calls visit(x, y, weights of the corners) for every sample inside the square of `cells` that the triangle covers, in
// steps of `fine`. A triangle that is folded over or empty covers none.
template <class Visit>
void rasterise(const std::array<IntegerPoint, 3>& corners, uint32_t cells, const Visit& visit) {
    const auto& [a, b, c] = corners;
    const int64_t twice = edge(a, b, c[0], c[1]);
    if (twice <= 0) return;
    const auto low = [&](size_t k) {
        return std::max<int64_t>(1, (std::min({corners[0][k], corners[1][k], corners[2][k]}) + fine - 1) / fine);
    };
    const auto high = [&](size_t k) {
        return std::min<int64_t>(cells - 1, std::max({corners[0][k], corners[1][k], corners[2][k]}) / fine);
    };
    for (int64_t y = low(1); y <= high(1); ++y) {
        for (int64_t x = low(0); x <= high(0); ++x) {
            const int64_t wa = edge(b, c, x * fine, y * fine), wb = edge(c, a, x * fine, y * fine),
                          wc = edge(a, b, x * fine, y * fine);
            if (wa < 0 || wb < 0 || wc < 0) continue;
            visit(x, y,
                  glm::dvec3(static_cast<double>(wa), static_cast<double>(wb), static_cast<double>(wc)) /
                      static_cast<double>(twice));
        }
    }
}
}  // namespace

AtlasAttributes attributes_of_atlas(const TriMesh& mesh, const BakedLooks* looks) {
    AtlasAttributes has = looks != nullptr ? looks->attributes() : AtlasAttributes{};
    const PresentAttributes source = attributes_of(mesh);
    has.normals = source.normals;
    has.uvs = source.uvs && !has.baked;
    has.colours = source.colours || has.colours;
    has.materials = source.materials;
    return has;
}

TexelAttributes source_attributes(const ResampleInput& input, const Atlas& atlas, uint32_t triangle,
                                  const glm::dvec2& place) {
    const TriMesh& mesh = input.mesh;
    const double w[3] = {1 - place.x - place.y, place.x, place.y};
    const Triangle& wedges = mesh.triangles[triangle];
    glm::dvec3 normal(0);
    glm::dvec2 uv(0);
    glm::dvec4 colour(0);
    uint32_t largest = 0;
    for (uint32_t k = 0; k < 3; ++k) {
        normal += w[k] * glm::dvec3(input.normals[wedges[k]]);
        if (atlas.attributes.uvs) uv += w[k] * glm::dvec2(mesh.uvs[wedges[k]]);
        if (!mesh.colours.empty()) colour += w[k] * glm::dvec4(mesh.colours[wedges[k]]);
        if (w[k] > w[largest]) largest = k;
    }
    TexelAttributes is;
    const double length = glm::length(normal);
    is.normal = pack_octahedral(length > 1e-12 ? glm::vec3(normal / length) : input.normals[wedges[largest]]);
    if (atlas.attributes.uvs) {
        for (int k = 0; k < 2; ++k) {
            const double s = atlas.uv_step[k] > 0 ? (uv[k] - atlas.uv_low[k]) / atlas.uv_step[k] : 0;
            is.uv[static_cast<size_t>(k)] =
                static_cast<uint16_t>(std::clamp(std::round(s), 0.0, static_cast<double>(most_uv)));
        }
    }
    if (!mesh.colours.empty()) is.colour = glm::u8vec4(glm::clamp(glm::round(colour), 0.0, 255.0));
    if (!mesh.materials.empty()) is.material = mesh.materials[wedges[largest]];
    return is;
}

Resampler::Resampler(const ResampleInput& input, ChartSizes positions, ChartSizes attributes)
    : input_(input), patches_(input.patches), up_(height_axis(input.mesh)) {
    const TriMesh& mesh = input.mesh;
    LODE_CHECK(input.normals.size() == mesh.wedge_count());
    atlas_.cells = positions.cells;
    atlas_.attribute_cells = attributes.cells;
    atlas_.attributes = attributes_of_atlas(mesh, input.looks);
    atlas_.material_table = mesh.material_table;
    atlas_.images = mesh.images;
    glm::dvec3 low(1e300), high(-1e300);
    for (const glm::dvec3& p : input.surface.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const glm::dvec3 extent = high - low;
    atlas_.origin = low;
    extent_ = std::max({extent.x, extent.y, extent.z, 1e-30});
    set_step(0);
    if (atlas_.attributes.uvs) set_uv_range();
    atlas_.lay_out(std::move(positions.trimmed_levels), std::move(attributes.trimmed_levels));
    if (!positions.unsampled_levels.empty()) atlas_.unsampled_levels = std::move(positions.unsampled_levels);
    if (!attributes.unsampled_levels.empty())
        atlas_.unsampled_attribute_levels = std::move(attributes.unsampled_levels);
    LODE_CHECK(atlas_.charts() == patches_.sides.size(), patches_.sides.size());
    atlas_.make_room();
    glue_sides();
    depths_ = SampleDepths(atlas_);
    borders_.emplace(input.surface, patches_, atlas_);
}

void Resampler::set_uv_range() {
    glm::vec2 low(1e30f), high(-1e30f);
    for (const glm::vec2& uv : input_.mesh.uvs) {
        low = glm::min(low, uv);
        high = glm::max(high, uv);
    }
    atlas_.uv_low = low;
    atlas_.uv_step = (high - low) / most_uv;
}

// Sides of one arc are glued.
void Resampler::glue_sides() {
    const auto quads = static_cast<uint32_t>(patches_.sides.size());
    atlas_.sides.resize(size_t{quads} * 4);
    std::vector<GluedSide> first(patches_.arcs.size());
    for (uint32_t q = 0; q < quads; ++q) {
        for (uint32_t s = 0; s < 4; ++s) {
            GluedSide& met = first[patches_.sides[q][s].arc];
            if (met.chart == ~0u) {
                met = {q, s};
                continue;
            }
            atlas_.sides[size_t{q} * 4 + s] = met;
            atlas_.sides[size_t{met.chart} * 4 + met.side] = {q, s};
        }
    }
}

void Resampler::set_step(double step) {
    atlas_.step = std::clamp(step, extent_ / most_points, extent_ / least_points);
    const auto points = static_cast<uint32_t>(std::ceil(extent_ / atlas_.step));
    atlas_.leaf_shift = leaf_bits - static_cast<uint32_t>(std::bit_width(points));
}

void Resampler::keep_corners_open() {
    if (up_) borders_->keep_corners_open(patches_, atlas_, depths_, *up_);
}

void Resampler::put(const Sampling& s, uint32_t x, uint32_t y, const SurfaceSample& place) {
    if ((x | y) % s.stride == 0) {
        auto& point = atlas_.positions[atlas_.texel(s.quad, x / s.ratio, y / s.ratio)];
        const glm::dvec3 lattice = atlas_.rounded(place.point);
        for (int k = 0; k < 3; ++k) point[static_cast<size_t>(k)] = static_cast<uint16_t>(lattice[k]);
    }
    if ((x | y) % s.attribute_stride == 0) put_attributes(s, atlas_.attribute_texel(s.quad, x, y), place);
}

void Resampler::put_new(Sampling& s, uint32_t x, uint32_t y, const SurfaceSample& place) {
    put(s, x, y, place);
    if ((x | y) % s.stride == 0) s.places[size_t{y} / s.stride * s.row + x / s.stride] = place;
}

// What a sample of the attributes stands for in a triangle of the chart, as a share of twice the area of the source's.
double Resampler::share_per_sample(const Sampling& s, uint32_t triangle) const {
    const ChartMesh& patch = s.chart.patch;
    const SurfaceTriangle& part = patch.triangles[triangle];
    const auto twice = [](const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
        const glm::dvec2 e = b - a, f = c - a;
        return std::abs(cross(e, f));
    };
    const CutPlaces::Corners& at = patch.places.of(part);
    const double of_source = twice(glm::dvec2(at[0]), glm::dvec2(at[1]), glm::dvec2(at[2])),
                 flat =
                     twice(patch.flat[part.vertices[0]], patch.flat[part.vertices[1]], patch.flat[part.vertices[2]]) *
                     s.cells * s.cells;
    return flat > 0 ? of_source / flat : 0;
}

void Resampler::put_attributes(const Sampling& s, size_t texel, const SurfaceSample& sample) {
    const ChartMesh& patch = s.chart.patch;
    const SurfaceTriangle& triangle = patch.triangles[sample.triangle];
    const CutPlaces::Corners& corners = patch.places.of(triangle);
    // From corners of the part to corners of the source triangle.
    glm::dvec2 place(0);
    for (int k = 0; k < 3; ++k) place += sample.weights[k] * glm::dvec2(corners[static_cast<size_t>(k)]);
    TexelAttributes is = source_attributes(input_, atlas_, triangle.source, place);
    if (input_.looks != nullptr) input_.looks->put(triangle.source, place, share_per_sample(s, sample.triangle), is);
    atlas_.normals[texel] = is.normal;
    if (!atlas_.surfaces.empty()) atlas_.surfaces[texel] = is.surface;
    if (!atlas_.emissions.empty()) atlas_.emissions[texel] = is.emission;
    if (!atlas_.uvs.empty()) atlas_.uvs[texel] = is.uv;
    if (!atlas_.colours.empty()) atlas_.colours[texel] = is.colour;
    if (!atlas_.materials.empty()) atlas_.materials[texel] = is.material;
}

void Resampler::sample_borders(Sampling& sampling) {
    const ChartMesh& patch = sampling.chart.patch;
    const uint32_t cells = sampling.cells;
    const auto number = patch.numbers();
    std::vector<uint32_t> along(patch.positions.size(), none);  // boundary half-edge out of a vertex
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        if (patch.twin[h] == none) along[patch.from(h)] = h;
    }
    for (uint32_t s = 0; s < 4; ++s) {
        const Side& side = patches_.sides[sampling.quad][s];
        const Arc& arc = patches_.arcs[side.arc];
        for (uint32_t k = 0; k <= cells; ++k) {
            const BorderSample& b = borders_->at(side.arc, side.reversed ? cells - k : k);
            const uint32_t begin = arc.vertices[b.segment + (side.reversed ? 1 : 0)];
            const uint32_t h = along[number.at(begin)];
            const double share = side.reversed ? 1 - b.share : b.share;
            glm::dvec3 weights(0);
            weights[static_cast<int>(h % 3)] = 1 - share;
            weights[static_cast<int>(next_corner(h) % 3)] = share;
            const auto [x, y] = on_side(s, k, cells);
            SurfaceSample place(patch, h / 3, weights);
            place.point = b.position;
            put_new(sampling, x, y, place);
        }
    }
}

uint32_t Resampler::sample_inside(Sampling& sampling) {
    const ChartMesh& patch = sampling.chart.patch;
    const uint32_t cells = sampling.cells;
    std::vector<IntegerPoint> at(patch.flat.size());
    for (size_t v = 0; v < at.size(); ++v) {
        for (int k = 0; k < 2; ++k)
            at[v][static_cast<size_t>(k)] = std::llround(patch.flat[v][k] * static_cast<double>(cells * fine));
    }
    std::vector<uint8_t> filled(size_t{cells + 1} * (cells + 1), 0);
    for (uint32_t triangle = 0; triangle < patch.triangles.size(); ++triangle) {
        const auto& v = patch.triangles[triangle].vertices;
        rasterise({at[v[0]], at[v[1]], at[v[2]]}, cells, [&](int64_t x, int64_t y, const glm::dvec3& weights) {
            const auto i = static_cast<size_t>(y * (cells + 1) + x);
            if (filled[i] || !sampling.is_sampled(static_cast<uint32_t>(x | y))) return;
            filled[i] = 1;
            put_new(sampling, static_cast<uint32_t>(x), static_cast<uint32_t>(y),
                    SurfaceSample(patch, triangle, weights));
        });
    }
    uint32_t missing = 0;
    for (uint32_t y = 1; y < cells; ++y) {
        for (uint32_t x = 1; x < cells; ++x) missing += sampling.is_sampled(x | y) && !filled[y * (cells + 1) + x];
    }
    return missing;
}

// What is not sampled, and samples that are not there.
void Resampler::fill_between(uint32_t quad) {
    if (!depths_.all_are_there()) fill_absent_positions(atlas_, quad, absent_samples(atlas_, depths_, quad));
    const PageTree tree = tree_of(atlas_, Layer::attributes, quad);
    if (tree.base_stride() == 1) return;
    Page page = read_page(atlas_, Layer::attributes, quad, 0);
    fill_unsampled(tree, channels_of(atlas_.attributes, Layer::attributes), tree.base_stride(), page);
    write_page(atlas_, Layer::attributes, quad, 0, page);
}

Sampled Resampler::sample(uint32_t quad, const Chart& chart) {
    const uint32_t cells = atlas_.attribute_cells_of(quad), ratio = atlas_.attribute_ratio_of(quad),
                   stride = ratio << atlas_.unsampled_levels[quad], row = cells / stride + 1;
    Sampling sampling{quad,   chart,
                      cells,  ratio,
                      stride, 1u << atlas_.unsampled_attribute_levels[quad],
                      row,    std::vector<SurfaceSample>(size_t{row} * row)};
    sample_borders(sampling);
    Sampled sampled;
    sampled.missing = sample_inside(sampling);
    if (sampled.missing > 0) return sampled;
    const Untangled untangled = untangle(chart.patch, sampling.places, row - 1, atlas_, up_);
    for (const uint32_t s : untangled.moved) put(sampling, s % row * stride, s / row * stride, sampling.places[s]);
    fill_between(quad);
    sampled.folded = untangled.before;
    sampled.still_folded = untangled.left;
    return sampled;
}

}  // namespace lodestone::vgi
