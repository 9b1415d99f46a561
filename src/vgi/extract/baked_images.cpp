#include "vgi/extract/baked_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "base/looks/srgb.h"
#include "base/threads.h"
#include "mesh/textures/filling.h"
#include "mesh/textures/tangent_frame.h"
#include "vgi/asset/pages.h"

namespace lodestone::vgi {

namespace {

// A chart's images of attributes, of one of its own levels, as an atlas of that chart alone: coarser ones are means.
Atlas chart_alone(const Atlas& atlas, uint32_t chart, uint32_t own_level) {
    Atlas alone;
    alone.cells = alone.attribute_cells = atlas.attribute_cells_of(chart) >> own_level;
    alone.attributes = atlas.attributes;
    alone.lay_out({0}, {0});
    alone.make_room();
    const PageTree tree = tree_of(atlas, Layer::attributes, chart);
    const std::vector<Page> pages = read_pages(atlas, Layer::attributes, chart);
    const uint32_t first = tree.page(own_level, 0, 0), per_side = tree.pages_per_side(own_level);
    // Pages are numbered from the coarsest level on, so its own are the first of the chart's.
    for (uint32_t p = first; p < first + per_side * per_side; ++p) write_page(alone, Layer::attributes, 0, p, pages[p]);
    return alone;
}

class BakedImages {
public:
    BakedImages(const Atlas& atlas, const ChartPlaces& places) : places_(places), size_(places.texels()) {
        const size_t texels = size_t{size_.x} * size_.y;
        if (atlas.attributes.colours) colours_.resize(texels);
        if (atlas.attributes.surfaces) surfaces_.resize(texels);
        if (atlas.attributes.emissions) emissions_.resize(texels);
        if (atlas.attributes.mapped_normals) normals_.resize(texels);
        covered_.assign(texels, 0);
        parallel_for(atlas.charts(), 1, [&](size_t begin, size_t end) {
            for (size_t c = begin; c < end; ++c) {
                const auto chart = static_cast<uint32_t>(c);
                if (places.own_level(chart) == 0)
                    put(atlas, chart, chart);
                else
                    put(chart_alone(atlas, chart, places.own_level(chart)), 0, chart);
            }
        });
    }

    // Of what the atlas has.
    void give(TriMesh& mesh) {
        mesh.images.clear();
        const int32_t colour = add(mesh, std::move(colours_)), surface = add(mesh, std::move(surfaces_)),
                      emission = add(mesh, std::move(emissions_)), normal = normals_.empty() ? -1 : add_map(mesh);
        if (mesh.material_table.empty()) mesh.material_table.resize(1);
        for (Material& m : mesh.material_table) {
            for (Texture* texture : m.textures()) *texture = {};
            m.base_colour_texture.image = colour;
            m.metallic_roughness_texture.image = m.occlusion_texture.image = surface;
            if (m.emission != glm::vec3(0)) m.emission_texture.image = emission;
            m.normal_texture.image = normal;
            m.normal_scale = 1;
            for (Texture* texture : m.textures()) {
                if (texture->there()) texture->wrap = {Wrap::clamp, Wrap::clamp};
            }
        }
    }

private:
    // from: has the chart's images under the number `in_it`.
    void put(const Atlas& from, uint32_t in_it, uint32_t chart) {
        const uint32_t cells = places_.cells(chart);
        const glm::uvec2 corner = places_.corner(chart);
        for (uint32_t y = 0; y <= cells; ++y) {
            for (uint32_t x = 0; x <= cells; ++x) {
                const size_t texel = from.attribute_texel(in_it, x, y),
                             at = size_t{corner.y + y} * size_.x + corner.x + x;
                covered_[at] = 1;
                if (!colours_.empty()) colours_[at] = from.colours[texel];
                if (!surfaces_.empty()) surfaces_[at] = opaque(from.surfaces[texel]);
                if (!emissions_.empty()) emissions_[at] = opaque(from.emissions[texel]);
                if (!normals_.empty()) normals_[at] = from.normals[texel];
            }
        }
    }
    static glm::u8vec4 opaque(const std::array<uint8_t, 3>& c) { return {c[0], c[1], c[2], 255}; }

    // Returns its number; -1 of none.
    int32_t add(TriMesh& mesh, std::vector<glm::u8vec4> texels) const {
        if (texels.empty()) return -1;
        Image image{size_.x, size_.y, std::move(texels)};
        std::vector<uint8_t> covered = covered_;
        fill_around(image, covered, glm::u8vec4(255));
        mesh.images.push_back(std::move(image));
        return static_cast<int32_t>(mesh.images.size()) - 1;
    }

    int32_t add_map(TriMesh& mesh) {
        constexpr glm::u8vec4 flat(128, 128, 255, 255);
        constexpr uint32_t band_rows = 64;
        Image image{size_.x, size_.y, {}};
        image.texels.assign(normals_.size(), flat);
        std::vector<uint8_t> drawn(normals_.size(), 0);
        const uint32_t bands = (size_.y + band_rows - 1) / band_rows;
        std::vector<std::vector<uint32_t>> in_band(bands);
        for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
            const auto [low, high] = rows_of(corners_of(mesh, t));
            for (uint32_t b = low / band_rows; low < high && b <= (high - 1) / band_rows; ++b) in_band[b].push_back(t);
        }
        parallel_for(bands, 1, [&](size_t begin, size_t end) {
            for (auto b = static_cast<uint32_t>(begin); b < end; ++b) {
                const uint32_t top = b * band_rows, below = std::min(top + band_rows, size_.y);
                for (const uint32_t t : in_band[b]) draw(mesh, t, top, below, image, drawn);
            }
        });
        fill_around(image, drawn, flat);
        mesh.images.push_back(std::move(image));
        return static_cast<int32_t>(mesh.images.size()) - 1;
    }

    using Corners = std::array<glm::dvec2, 3>;
    // In texels whose middles are whole numbers.
    Corners corners_of(const TriMesh& mesh, uint32_t t) const {
        Corners corners;
        for (size_t k = 0; k < 3; ++k)
            corners[k] = glm::dvec2(mesh.uvs[mesh.triangles[t][k]]) * glm::dvec2(size_) - 0.5;
        return corners;
    }
    // Rows of texels whose middles it may hold, and the one behind them.
    std::pair<uint32_t, uint32_t> rows_of(const Corners& p) const { return range(p[0].y, p[1].y, p[2].y, size_.y); }
    static std::pair<uint32_t, uint32_t> range(double a, double b, double c, uint32_t size) {
        const double low = std::ceil(std::min({a, b, c}) - nearness), high = std::floor(std::max({a, b, c}) + nearness);
        return {static_cast<uint32_t>(std::max(low, 0.0)),
                static_cast<uint32_t>(std::clamp(high + 1, 0.0, static_cast<double>(size)))};
    }

    // Texels of rows top .. below.
    void draw(const TriMesh& mesh, uint32_t t, uint32_t top, uint32_t below, Image& image,
              std::vector<uint8_t>& drawn) const {
        const Corners p = corners_of(mesh, t);
        const glm::dvec2 e = p[1] - p[0], f = p[2] - p[0];
        const double area = e.x * f.y - e.y * f.x;
        if (area == 0) return;
        const glm::dvec3 a(mesh.position_of(t, 0));
        const TangentFrame frame =
            tangent_frame(glm::dvec3(mesh.position_of(t, 1)) - a, glm::dvec3(mesh.position_of(t, 2)) - a, e, f);
        // What a weight changes in `nearness` texels.
        const double reach = nearness * std::max({glm::length(e), glm::length(f), glm::length(f - e)}) / std::abs(area);
        const auto [first, last] = rows_of(p);
        const auto [left, right] = range(p[0].x, p[1].x, p[2].x, size_.x);
        for (uint32_t y = std::max(first, top); y < std::min(last, below); ++y) {
            for (uint32_t x = left; x < right; ++x) {
                const glm::dvec2 at = glm::dvec2(x, y) - p[0];
                const double v = (at.x * f.y - at.y * f.x) / area, w = (e.x * at.y - e.y * at.x) / area;
                const size_t texel = size_t{y} * size_.x + x;
                if (std::min({v, w, 1 - v - w}) < -reach || covered_[texel] == 0 || drawn[texel] != 0) continue;
                const auto normal = [&](size_t k) { return glm::dvec3(mesh.normals[mesh.triangles[t][k]]); };
                image.texels[texel] = in_frame(frame, (1 - v - w) * normal(0) + v * normal(1) + w * normal(2),
                                               glm::dvec3(unpack_octahedral(normals_[texel])));
                drawn[texel] = 1;
            }
        }
    }

    // across: any length. As a texel of a map.
    static glm::u8vec4 in_frame(const TangentFrame& frame, const glm::dvec3& across, const glm::dvec3& mapped) {
        const double length = glm::length(across);
        const glm::dvec3 normal = length > 0 ? across / length : mapped;
        const auto ways = frame.upright(normal);
        if (!ways) return {128, 128, 255, 255};
        const glm::dvec3 turned(glm::dot(mapped, (*ways)[0]), glm::dot(mapped, (*ways)[1]), glm::dot(mapped, normal));
        const glm::vec3 share = 0.5 + 0.5 * turned;
        return {byte_of_share(share.x), byte_of_share(share.y), byte_of_share(share.z), 255};
    }

    static constexpr double nearness = 0.02;  // texels: what coordinates of 32 bits may be off by in a large texture
    const ChartPlaces& places_;
    const glm::uvec2 size_;
    std::vector<glm::u8vec4> colours_, surfaces_, emissions_;  // each empty where the atlas has none
    std::vector<std::array<int8_t, 2>> normals_;
    std::vector<uint8_t> covered_;  // by samples
};

}  // namespace

void use_baked_images(const Atlas& atlas, const ChartPlaces& places, ExtractedMesh& extracted) {
    TriMesh& mesh = extracted.mesh;
    if (atlas.attributes.mapped_normals) {
        const std::vector<glm::vec3> smooth = vertex_normals(mesh);
        for (size_t w = 0; w < smooth.size(); ++w) {
            if (extracted.is_sample[w]) mesh.normals[w] = smooth[w];
        }
    }
    BakedImages(atlas, places).give(mesh);
}

}  // namespace lodestone::vgi
