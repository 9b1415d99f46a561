#include "vgi/bake/images/resample.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/check.h"
#include "vgi/bake/images/untangle.h"

namespace lodestone::vgi {

namespace {
// Texture coordinates have 14 bits: a quarter of a texel of a 4096^2 texture.
constexpr float most_uv = 16383;
constexpr int64_t fine = int64_t{1} << 18;  // integer steps per cell: edge functions stay below 2^62 up to 4096 cells
}  // namespace

Resampler::Resampler(const TriMesh& mesh, std::span<const glm::vec3> normals, const Surface& surface,
                     const ChartComplex& patches, uint32_t cells, uint32_t attribute_cells,
                     std::vector<uint8_t> trimmed_levels)
    : mesh_(mesh), normals_(normals), patches_(patches), up_(height_axis(mesh)) {
    LODE_CHECK(normals.size() == mesh.wedge_count());
    const auto quads = static_cast<uint32_t>(patches.sides.size());
    atlas_.cells = cells;
    atlas_.attribute_cells = attribute_cells;
    atlas_.attributes = attributes_of(mesh);
    atlas_.material_table = mesh.material_table;
    atlas_.images = mesh.images;
    glm::dvec3 low(1e300), high(-1e300);
    for (const glm::dvec3& p : surface.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const glm::dvec3 extent = high - low;
    atlas_.origin = low;
    extent_ = std::max({extent.x, extent.y, extent.z, 1e-30});
    set_step(0);
    if (!mesh.uvs.empty()) {
        glm::vec2 uv_low(1e30f), uv_high(-1e30f);
        for (const glm::vec2& uv : mesh.uvs) {
            uv_low = glm::min(uv_low, uv);
            uv_high = glm::max(uv_high, uv);
        }
        atlas_.uv_low = uv_low;
        atlas_.uv_step = (uv_high - uv_low) / most_uv;
    }
    atlas_.lay_out(std::move(trimmed_levels));
    LODE_CHECK(atlas_.charts() == quads, quads);
    atlas_.make_room();
    // Sides of one arc are glued.
    atlas_.sides.resize(size_t{quads} * 4);
    std::vector<GluedSide> first(patches.arcs.size());
    for (uint32_t q = 0; q < quads; ++q) {
        for (uint32_t s = 0; s < 4; ++s) {
            GluedSide& met = first[patches.sides[q][s].arc];
            if (met.chart == ~0u) {
                met = {q, s};
                continue;
            }
            atlas_.sides[size_t{q} * 4 + s] = met;
            atlas_.sides[size_t{met.chart} * 4 + met.side] = {q, s};
        }
    }
    borders_.emplace(surface, patches, atlas_);
}

void Resampler::set_step(double step) { atlas_.step = std::clamp(step, extent_ / most_points, extent_ / least_points); }

void Resampler::keep_corners_open() {
    if (up_) borders_->keep_corners_open(patches_, atlas_, *up_);
}

void Resampler::put(uint32_t chart, uint32_t x, uint32_t y, const glm::dvec3& position, uint32_t source,
                    const CutPlaces::Corners& places, const glm::dvec3& weights) {
    const uint32_t ratio = atlas_.attribute_cells / atlas_.cells;
    if (x % ratio == 0 && y % ratio == 0) {
        auto& point = atlas_.positions[atlas_.texel(chart, x / ratio, y / ratio)];
        const glm::dvec3 lattice = atlas_.rounded(position);
        for (int k = 0; k < 3; ++k) point[static_cast<size_t>(k)] = static_cast<uint16_t>(lattice[k]);
    }
    const size_t texel = atlas_.attribute_texel(chart, x, y);
    // From corners of the part to corners of the source triangle.
    glm::dvec2 place(0);
    for (int k = 0; k < 3; ++k) place += weights[k] * glm::dvec2(places[static_cast<size_t>(k)]);
    const double w[3] = {1 - place.x - place.y, place.x, place.y};
    const Triangle& wedges = mesh_.triangles[source];
    glm::dvec3 normal(0);
    glm::dvec2 uv(0);
    glm::dvec4 colour(0);
    uint32_t largest = 0;
    for (uint32_t k = 0; k < 3; ++k) {
        normal += w[k] * glm::dvec3(normals_[wedges[k]]);
        if (!mesh_.uvs.empty()) uv += w[k] * glm::dvec2(mesh_.uvs[wedges[k]]);
        if (!mesh_.colours.empty()) colour += w[k] * glm::dvec4(mesh_.colours[wedges[k]]);
        if (w[k] > w[largest]) largest = k;
    }
    const double length = glm::length(normal);
    atlas_.normals[texel] = pack_octahedral(length > 1e-12 ? glm::vec3(normal / length) : normals_[wedges[largest]]);
    if (!mesh_.uvs.empty()) {
        for (int k = 0; k < 2; ++k) {
            const double s = atlas_.uv_step[k] > 0 ? (uv[k] - atlas_.uv_low[k]) / atlas_.uv_step[k] : 0;
            atlas_.uvs[texel][static_cast<size_t>(k)] =
                static_cast<uint16_t>(std::clamp(std::round(s), 0.0, static_cast<double>(most_uv)));
        }
    }
    if (!mesh_.colours.empty()) atlas_.colours[texel] = glm::u8vec4(glm::clamp(glm::round(colour), 0.0, 255.0));
    if (!mesh_.materials.empty()) atlas_.materials[texel] = mesh_.materials[wedges[largest]];
}

Sampled Resampler::sample(uint32_t quad, const Chart& chart) {
    const ChartMesh& patch = chart.patch;
    const uint32_t cells = atlas_.attribute_cells_of(quad), ratio = atlas_.attribute_cells / atlas_.cells,
                   row = cells / ratio + 1;
    std::vector<SurfaceSample> places(size_t{row} * row);  // of positions
    const auto put_place = [&](uint32_t x, uint32_t y, const SurfaceSample& place) {
        const SurfaceTriangle& t = patch.triangles[place.triangle];
        put(quad, x, y, place.point, t.source, patch.places.of(t), place.weights);
    };
    const auto put_new = [&](uint32_t x, uint32_t y, const SurfaceSample& place) {
        put_place(x, y, place);
        if (x % ratio == 0 && y % ratio == 0) places[size_t{y} / ratio * row + x / ratio] = place;
    };
    // Borders.
    const auto number = patch.numbers();
    std::vector<uint32_t> along(patch.positions.size(), none);  // boundary half-edge out of a vertex
    for (uint32_t h = 0; h < patch.twin.size(); ++h) {
        if (patch.twin[h] == none) along[patch.from(h)] = h;
    }
    for (uint32_t s = 0; s < 4; ++s) {
        const Side& side = patches_.sides[quad][s];
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
            put_new(x, y, place);
        }
    }
    // Inside.
    std::vector<std::array<int64_t, 2>> at(patch.flat.size());
    for (size_t v = 0; v < at.size(); ++v) {
        for (int k = 0; k < 2; ++k)
            at[v][static_cast<size_t>(k)] = std::llround(patch.flat[v][k] * static_cast<double>(cells * fine));
    }
    std::vector<uint8_t> filled(size_t{cells + 1} * (cells + 1), 0);
    for (uint32_t triangle = 0; triangle < patch.triangles.size(); ++triangle) {
        const SurfaceTriangle& t = patch.triangles[triangle];
        const auto &a = at[t.vertices[0]], &b = at[t.vertices[1]], &c = at[t.vertices[2]];
        const auto edge = [](const std::array<int64_t, 2>& p, const std::array<int64_t, 2>& q, int64_t x, int64_t y) {
            return (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        };
        const int64_t twice = edge(a, b, c[0], c[1]);
        if (twice <= 0) continue;
        const auto low = [&](size_t k) {
            return std::max<int64_t>(1, (std::min({a[k], b[k], c[k]}) + fine - 1) / fine);
        };
        const auto high = [&](size_t k) { return std::min<int64_t>(cells - 1, std::max({a[k], b[k], c[k]}) / fine); };
        for (int64_t y = low(1); y <= high(1); ++y) {
            for (int64_t x = low(0); x <= high(0); ++x) {
                const int64_t wa = edge(b, c, x * fine, y * fine), wb = edge(c, a, x * fine, y * fine),
                              wc = edge(a, b, x * fine, y * fine);
                if (wa < 0 || wb < 0 || wc < 0) continue;
                const auto i = static_cast<size_t>(y * (cells + 1) + x);
                if (filled[i]) continue;
                filled[i] = 1;
                const glm::dvec3 weights =
                    glm::dvec3(static_cast<double>(wa), static_cast<double>(wb), static_cast<double>(wc)) /
                    static_cast<double>(twice);
                put_new(static_cast<uint32_t>(x), static_cast<uint32_t>(y), SurfaceSample(patch, triangle, weights));
            }
        }
    }
    Sampled sampled;
    for (uint32_t y = 1; y < cells; ++y) {
        for (uint32_t x = 1; x < cells; ++x) sampled.missing += !filled[y * (cells + 1) + x];
    }
    if (sampled.missing > 0) return sampled;
    const Untangled unfolded = untangle(patch, places, row - 1, atlas_, up_);
    for (const uint32_t s : unfolded.moved) put_place(s % row * ratio, s / row * ratio, places[s]);
    sampled.folded = unfolded.before;
    sampled.still_folded = unfolded.left;
    return sampled;
}

}  // namespace lodestone::vgi
