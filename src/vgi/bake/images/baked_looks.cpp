#include "vgi/bake/images/baked_looks.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/looks/srgb.h"
#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "vgi/asset/atlas.h"
#include "vgi/bake/charts/chart_mesh.h"

namespace lodestone::vgi {

namespace {

// Of the finest textures of a material, for texture coordinates 0 .. 1 of the first set and of the second.
std::array<double, 2> most_texels(const Material& m, const std::vector<Image>& images) {
    std::array<double, 2> most{};
    for (const Texture* texture : m.textures()) {
        if (!texture->there()) continue;
        const Image& image = images[static_cast<size_t>(texture->image)];
        const double turned = std::abs(cross(texture->place[0], texture->place[1]));
        double& of_set = most[texture->second ? 1 : 0];
        of_set = std::max(of_set, turned * static_cast<double>(image.width) * image.height);
    }
    return most;
}

// Twice the area of a triangle in the plane of texture coordinates; 0 where there are none.
double twice_area(const std::vector<glm::vec2>& uvs, const Triangle& t) {
    if (uvs.empty()) return 0;
    return std::abs(
        cross(glm::dvec2(uvs[t[1]]) - glm::dvec2(uvs[t[0]]), glm::dvec2(uvs[t[2]]) - glm::dvec2(uvs[t[0]])));
}

// As shaders/shared/materials.glsl has it.
glm::vec3 mapped_normal(const TangentFrame& frame, glm::vec3 map, float scale, const glm::dvec3& normal) {
    const auto axes = frame.upright(normal);
    const glm::dvec3 bent = (2.0 * glm::dvec3(map) - 1.0) * glm::dvec3(scale, scale, 1);
    if (!axes || !(glm::dot(bent, bent) > 1e-6)) return normal;
    return glm::normalize((*axes)[0] * bent.x + (*axes)[1] * bent.y + normal * bent.z);
}

}  // namespace

BakedLooks::BakedLooks(const TriMesh& mesh, std::span<const glm::vec3> normals)
    : mesh_(mesh), normals_(normals), colours_(mesh.images.size()), numbers_(mesh.images.size()) {
    if (mesh.uvs.empty()) return;
    for (const Material& m : mesh.material_table) finest_.push_back(most_texels(m, mesh.images));
    std::vector<uint8_t> asked(2 * mesh.images.size(), 0);
    for (const Material& m : mesh.material_table) {
        const auto textures = m.textures();
        for (size_t t = 0; t < textures.size(); ++t) {
            if (textures[t]->there())
                asked[2 * static_cast<size_t>(textures[t]->image) + (holds_colours(t) ? 0 : 1)] = 1;
        }
    }
    parallel_for(asked.size(), 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            if (asked[i] == 0) continue;
            (i % 2 == 0 ? colours_ : numbers_)[i / 2].emplace(mesh.images[i / 2],
                                                              i % 2 == 0 ? Texels::colours : Texels::numbers);
        }
    });
}

AtlasAttributes BakedLooks::attributes() const {
    AtlasAttributes has;
    for (const Material& m : mesh_.material_table) {
        has.colours = has.colours || m.base_colour_texture.there();
        has.surfaces = has.surfaces || m.metallic_roughness_texture.there() || m.occlusion_texture.there();
        has.emissions = has.emissions || m.emission_texture.there();
        has.mapped_normals = has.mapped_normals || m.normal_texture.there();
    }
    has.baked = !mesh_.uvs.empty() && (has.colours || has.surfaces || has.emissions || has.mapped_normals);
    return has.baked ? has : AtlasAttributes{};
}

const Material& BakedLooks::material_of(uint32_t triangle) const {
    return mesh_.material_table[mesh_.materials.empty() ? 0 : mesh_.materials[mesh_.triangles[triangle][0]]];
}

double BakedLooks::texels(uint32_t triangle) const {
    if (finest_.empty()) return 0;
    const Triangle& t = mesh_.triangles[triangle];
    const auto& [first, second] = finest_[mesh_.materials.empty() ? 0 : mesh_.materials[t[0]]];
    return 0.5 * std::max(twice_area(mesh_.uvs, t) * first, twice_area(mesh_.second_uvs, t) * second);
}

std::optional<BakedLooks::LookedUp> BakedLooks::texture_of(const Texture& texture, Texels texels) const {
    if (!texture.there()) return std::nullopt;
    const auto& images = texels == Texels::colours ? colours_ : numbers_;
    return LookedUp{&*images[static_cast<size_t>(texture.image)], &texture};
}

glm::vec4 BakedLooks::at(const LookedUp& from, const Places& places) {
    const Place& where = places[from.texture->second ? 1 : 0];
    const glm::dmat3x2 place(from.texture->place);
    const double turned = std::abs(cross(place[0], place[1]));
    const double texels = where.uv_per_sample * turned * from.image->width() * from.image->height();
    return from.image->at(place * glm::dvec3(where.uv, 1), 0.5 * std::log2(std::max(texels, 1.0)), from.texture->wrap);
}

// Without tangents that of the triangle's texture coordinates.
TangentFrame BakedLooks::frame_at(uint32_t triangle, const std::array<double, 3>& weights, const Texture& map,
                                  const glm::dvec3& normal) const {
    const Triangle& t = mesh_.triangles[triangle];
    glm::dvec4 tangent(0);
    for (size_t k = 0; k < 3 && !mesh_.tangents.empty(); ++k) tangent += weights[k] * glm::dvec4(mesh_.tangents[t[k]]);
    if (tangent.w != 0) return tangent_frame(tangent, normal);
    const glm::dmat3x2 place(map.place);
    const std::vector<glm::vec2>& uvs = mesh_.uvs_of(map);
    if (uvs.empty()) return {};
    const auto placed = [&](uint32_t wedge) { return place * glm::dvec3(uvs[wedge], 1); };
    const glm::dvec3 p(mesh_.positions[mesh_.wedge_vertex[t[0]]]),
        e = glm::dvec3(mesh_.positions[mesh_.wedge_vertex[t[1]]]) - p,
        f = glm::dvec3(mesh_.positions[mesh_.wedge_vertex[t[2]]]) - p;
    const glm::dvec2 first = placed(t[0]), uv_e = placed(t[1]) - first, uv_f = placed(t[2]) - first;
    return tangent_frame(e, f, uv_e, uv_f);
}

void BakedLooks::put(uint32_t triangle, const glm::dvec2& place, double share, TexelAttributes& is) const {
    const Triangle& t = mesh_.triangles[triangle];
    const std::array<double, 3> w{1 - place.x - place.y, place.x, place.y};
    Places places;
    glm::dvec3 normal(0);
    for (uint32_t k = 0; k < 3; ++k) {
        places[0].uv += w[k] * glm::dvec2(mesh_.uvs[t[k]]);
        if (!mesh_.second_uvs.empty()) places[1].uv += w[k] * glm::dvec2(mesh_.second_uvs[t[k]]);
        normal += w[k] * glm::dvec3(normals_[t[k]]);
    }
    places[0].uv_per_sample = share * twice_area(mesh_.uvs, t);
    places[1].uv_per_sample = share * twice_area(mesh_.second_uvs, t);
    const Material& m = material_of(triangle);
    if (const auto colour = texture_of(m.base_colour_texture, Texels::colours)) {
        const glm::vec4 texture = at(*colour, places);
        for (int k = 0; k < 3; ++k) is.colour[k] = srgb_byte_of(texture[k] * linear_of_byte(is.colour[k]));
        is.colour.w = byte_of_share(texture.w * static_cast<float>(is.colour.w) / 255);
    }
    if (const auto factors = texture_of(m.metallic_roughness_texture, Texels::numbers)) {
        const glm::vec4 texture = at(*factors, places);
        is.surface[1] = byte_of_share(texture.y);
        is.surface[2] = byte_of_share(texture.z);
    }
    if (const auto occlusion = texture_of(m.occlusion_texture, Texels::numbers))
        is.surface[0] = byte_of_share(at(*occlusion, places).x);
    if (const auto emission = texture_of(m.emission_texture, Texels::colours)) {
        const glm::vec4 texture = at(*emission, places);
        for (int k = 0; k < 3; ++k) is.emission[static_cast<size_t>(k)] = srgb_byte_of(texture[k]);
    }
    const auto map = texture_of(m.normal_texture, Texels::numbers);
    const double length = glm::length(normal);
    if (map && length > 1e-12) {
        const TangentFrame frame = frame_at(triangle, w, m.normal_texture, normal / length);
        is.normal = pack_octahedral(mapped_normal(frame, at(*map, places), m.normal_scale, normal / length));
    }
}

namespace {

// What samples that are one place have together.
struct Meeting {
    glm::vec4 colour{0};
    glm::vec3 surface{0}, emission{0}, normal{0};  // normal: of unit vectors
    float samples = 0;
    bool edge = false;  // normals are too far apart to be of one side of the surface's edges
};

class BorderMeans {
public:
    explicit BorderMeans(Atlas& atlas) : atlas_(atlas), together_(0) {}

    void run() {
        number_samples();
        join_samples();
        std::vector<Meeting> meetings(texels_.size());
        for (uint32_t i = 0; i < texels_.size(); ++i) add(texels_[i], meetings[together_.find(i)]);
        for (uint32_t i = 0; i < texels_.size(); ++i) {
            Meeting& met = meetings[together_.find(i)];
            // Those that are each other's opposite have no mean.
            met.edge |= !(glm::dot(atlas_.normal(texels_[i]), met.normal) > least_cosine * glm::length(met.normal));
        }
        for (uint32_t i = 0; i < texels_.size(); ++i) {
            const Meeting& met = meetings[together_.find(i)];
            if (met.samples > 1) put(met, texels_[i]);
        }
    }

private:
    static constexpr float least_cosine = 0.94f;  // 20 degrees

    // Of a side's sample; corners have a number for each of their two sides.
    uint32_t number(uint32_t chart, uint32_t side, uint32_t step) const {
        return first_[chart] + side * (atlas_.attribute_cells_of(chart) + 1) + step;
    }
    void number_samples() {
        for (uint32_t c = 0; c < atlas_.charts(); ++c) {
            first_.push_back(static_cast<uint32_t>(texels_.size()));
            const uint32_t n = atlas_.attribute_cells_of(c);
            for (uint32_t side = 0; side < 4; ++side) {
                for (uint32_t step = 0; step <= n; ++step) {
                    const auto [x, y] = on_side(side, step, n);
                    texels_.push_back(atlas_.attribute_texel(c, x, y));
                }
            }
        }
        together_ = DisjointSets(texels_.size());
    }
    void join_samples() {
        for (uint32_t c = 0; c < atlas_.charts(); ++c) {
            const uint32_t n = atlas_.attribute_cells_of(c);
            for (uint32_t side = 0; side < 4; ++side) {
                together_.join(number(c, side, n), number(c, (side + 1) % 4, 0));
                const GluedSide& glued = atlas_.sides[4 * c + side];
                if (glued.chart == ~0u) continue;
                for (uint32_t step = 0; step <= n; ++step) {
                    const uint32_t a = number(c, side, step), b = number(glued.chart, glued.side, n - step);
                    if (alike(texels_[a], texels_[b])) together_.join(a, b);
                }
            }
        }
    }
    bool alike(size_t a, size_t b) const {
        return atlas_.materials.empty() || atlas_.materials[a] == atlas_.materials[b];
    }
    void add(size_t texel, Meeting& to) const {
        if (!atlas_.colours.empty()) {
            const glm::u8vec4& c = atlas_.colours[texel];
            to.colour +=
                glm::vec4(linear_of_byte(c.x), linear_of_byte(c.y), linear_of_byte(c.z), static_cast<float>(c.w) / 255);
        }
        for (int k = 0; k < 3; ++k) {
            const auto channel = static_cast<size_t>(k);
            if (!atlas_.surfaces.empty()) to.surface[k] += static_cast<float>(atlas_.surfaces[texel][channel]) / 255;
            if (!atlas_.emissions.empty()) to.emission[k] += linear_of_byte(atlas_.emissions[texel][channel]);
        }
        to.normal += atlas_.normal(texel);
        to.samples += 1;
    }
    void put(const Meeting& met, size_t texel) {
        if (!atlas_.colours.empty()) {
            const glm::vec4 c = met.colour / met.samples;
            atlas_.colours[texel] = {srgb_byte_of(c.x), srgb_byte_of(c.y), srgb_byte_of(c.z), byte_of_share(c.w)};
        }
        for (int k = 0; k < 3; ++k) {
            const auto channel = static_cast<size_t>(k);
            if (!atlas_.surfaces.empty()) atlas_.surfaces[texel][channel] = byte_of_share(met.surface[k] / met.samples);
            if (!atlas_.emissions.empty())
                atlas_.emissions[texel][channel] = srgb_byte_of(met.emission[k] / met.samples);
        }
        if (atlas_.attributes.mapped_normals && !met.edge)
            atlas_.normals[texel] = pack_octahedral(glm::normalize(met.normal));
    }

    Atlas& atlas_;
    std::vector<uint32_t> first_;  // per chart
    std::vector<size_t> texels_;   // per number
    DisjointSets together_;
};

}  // namespace

void agree_on_borders(Atlas& atlas) { BorderMeans(atlas).run(); }

}  // namespace lodestone::vgi
