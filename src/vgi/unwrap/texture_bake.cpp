#include "vgi/unwrap/texture_bake.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string>
#include <utility>

#include "base/check.h"
#include "base/looks/srgb.h"
#include "base/threads.h"
#include "mesh/textures/filling.h"

namespace lodestone::vgi {

namespace {

constexpr uint32_t band_rows = 32;                    // of an image, made at once
constexpr int fewest_samples = 2, most_samples = 32;  // along a side of a texel
constexpr float least_weight = 1.0f / 4096;           // of what lets all light through: its colour matters to nobody

// Sums over the samples of a texel.
struct Texel {
    glm::vec3 colour{0};  // times weight
    float weight = 0, alpha = 0, samples = 0;
    void add(const glm::vec4& sample, float share) {
        const float w = std::max(sample.w, least_weight) * share;
        colour += glm::vec3(sample) * w;
        weight += w;
        alpha += sample.w * share;
        samples += share;
    }
    glm::u8vec4 stored(Look look) const {
        glm::vec3 c = colour / weight;
        if (look == Look::colour || look == Look::emission)
            return {srgb_byte_of(c.x), srgb_byte_of(c.y), srgb_byte_of(c.z), byte_of_share(alpha / samples)};
        if (look == Look::normals) {
            const float length = glm::length(c);
            c = 0.5f + 0.5f * (length > 1e-6f ? c / length : glm::vec3(0, 0, 1));
        }
        return {byte_of_share(c.x), byte_of_share(c.y), byte_of_share(c.z), 255};
    }
};

class TextureBake {
public:
    TextureBake(const TriMesh& source, const Unwrapped& unwrapped, uint32_t squares, uint32_t resolution)
        : source_(source),
          unwrapped_(unwrapped),
          resolution_(resolution),
          bands_((resolution + band_rows - 1) / band_rows) {
        in_band_.resize(size_t{squares} * bands_);
        for (uint32_t t = 0; t < unwrapped.mesh.triangle_count(); ++t) {
            double low = resolution, high = 0;
            for (const uint32_t w : unwrapped.mesh.triangles[t]) {
                low = std::min(low, static_cast<double>(unwrapped.mesh.uvs[w].y) * resolution);
                high = std::max(high, static_cast<double>(unwrapped.mesh.uvs[w].y) * resolution);
            }
            const auto last = std::min(static_cast<uint32_t>(high) / band_rows, bands_ - 1);
            for (uint32_t b = static_cast<uint32_t>(low) / band_rows; b <= last; ++b)
                in_band_[size_t{unwrapped.square[t]} * bands_ + b].push_back(t);
        }
    }

    // brightest: of emission.
    Image run(uint32_t square, Look look, float brightest) const {
        Image image{resolution_, resolution_, {}};
        image.texels.resize(size_t{resolution_} * resolution_);
        std::vector<uint8_t> covered(image.texels.size(), 0);
        parallel_for(bands_, 1, [&](size_t begin, size_t end) {
            std::vector<Texel> texels;
            for (size_t b = begin; b < end; ++b) {
                texels.assign(size_t{resolution_} * band_rows, {});
                for (const uint32_t t : in_band_[square * bands_ + b]) {
                    const OldLooks looks(source_, unwrapped_, t, resolution_, look, brightest);
                    draw(looks, static_cast<uint32_t>(b) * band_rows, texels);
                }
                const size_t first = b * band_rows * resolution_,
                             count = std::min(texels.size(), image.texels.size() - first);
                for (size_t i = 0; i < count; ++i) {
                    if (texels[i].samples == 0) continue;
                    covered[first + i] = 1;
                    image.texels[first + i] = texels[i].stored(look);
                }
            }
        });
        const glm::u8vec4 nothing = look == Look::normals ? glm::u8vec4(128, 128, 255, 255) : glm::u8vec4(255);
        fill_around(image, covered, nothing);
        return image;
    }

private:
    // Samples of the triangle in the band whose first row is `top`.
    void draw(const OldLooks& looks, uint32_t top, std::vector<Texel>& texels) const {
        if (looks.flat()) return;
        const auto& corners = looks.corners();
        const glm::dvec2& a = corners[0];
        // Along a side of a texel, so that there are two samples or more to a texel of the old image.
        const int n = static_cast<int>(
            std::clamp(std::ceil(2 * looks.texels_per_texel()), double{fewest_samples}, double{most_samples}));
        const float share = 1.0f / static_cast<float>(n * n);
        const double low = std::max(std::min({a.y, corners[1].y, corners[2].y}), static_cast<double>(top)),
                     high = std::min(std::max({a.y, corners[1].y, corners[2].y}),
                                     static_cast<double>(std::min(top + band_rows, resolution_)));
        // Rows of samples lie at (i + 1/2) / n.
        const auto first_at = [&](double at) { return static_cast<int64_t>(std::ceil(at * n - 0.5)); };
        for (int64_t row = first_at(low); row < first_at(high); ++row) {
            const double y = (static_cast<double>(row) + 0.5) / n;
            const auto [begin, end] = span_at(corners, y);
            const size_t line = (static_cast<size_t>(row / n) - top) * resolution_;
            for (int64_t column = std::max<int64_t>(first_at(begin), 0); column < first_at(end); ++column) {
                const auto x = static_cast<size_t>(column / n);
                if (x >= resolution_) break;
                texels[line + x].add(looks.at({(static_cast<double>(column) + 0.5) / n - a.x, y - a.y}), share);
            }
        }
    }

    // Where a row lies in the triangle.
    static std::pair<double, double> span_at(const std::array<glm::dvec2, 3>& corners, double y) {
        double begin = 1e300, end = -1e300;
        for (size_t k = 0; k < 3; ++k) {
            const glm::dvec2 &p = corners[k], &q = corners[(k + 1) % 3];
            if ((p.y <= y) == (q.y <= y)) continue;
            // From the lower end, so that both triangles along an edge find the same place.
            const glm::dvec2 &from = p.y < q.y ? p : q, &to = p.y < q.y ? q : p;
            const double x = from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y));
            begin = std::min(begin, x);
            end = std::max(end, x);
        }
        return {begin, end};
    }

    const TriMesh& source_;
    const Unwrapped& unwrapped_;
    const uint32_t resolution_, bands_;
    std::vector<std::vector<uint32_t>> in_band_;  // triangles, per square and band
};

// Materials that the mesh has something of, in their order.
std::vector<Material> used_materials(const TriMesh& mesh) {
    if (mesh.material_table.empty()) return {};
    if (mesh.materials.empty()) return {mesh.material_table[0]};
    std::vector<bool> used(mesh.material_table.size(), false);
    for (const uint16_t m : mesh.materials) used[m] = true;
    std::vector<Material> table;
    for (size_t m = 0; m < used.size(); ++m) {
        if (used[m]) table.push_back(mesh.material_table[m]);
    }
    return table;
}

template <class Has>
bool any(const std::vector<Material>& table, Has&& has) {
    return std::ranges::any_of(table, has);
}

// Which by_look are of use beside colours.
struct Needs {
    bool metal = false, occlusion = false, normals = false, emission = false;
};
Needs needs_of(const std::vector<Material>& used) {
    if (used.empty()) return {};
    const Material& first = used.front();
    Needs needs;
    needs.metal = any(used, [&](const Material& m) {
        return m.metallic_roughness_texture.there() || m.metallic != first.metallic || m.roughness != first.roughness;
    });
    needs.occlusion = any(used, [](const Material& m) { return m.occlusion_texture.there(); });
    needs.normals = any(used, [](const Material& m) { return m.normal_texture.there(); });
    needs.emission = any(used, [&](const Material& m) {
        return m.emission != first.emission || (m.emission_texture.there() && m.emission != glm::vec3(0));
    });
    return needs;
}

}  // namespace

BakedTextures bake_textures(const TriMesh& source, const Unwrapped& unwrapped, uint32_t squares, uint32_t resolution) {
    LODE_CHECK(resolution > 0);
    const TextureBake bake(source, unwrapped, squares, resolution);
    const std::vector<Material> used = used_materials(source);
    const Needs needs = needs_of(used);
    BakedTextures baked;
    baked.metal = needs.metal;
    baked.occlusion = needs.occlusion;
    if (needs.emission) {
        baked.brightest = 0;
        for (const Material& m : used)
            baked.brightest = std::max({baked.brightest, m.emission.x, m.emission.y, m.emission.z});
    }
    const std::array<bool, look_count> made = {true, needs.metal || needs.occlusion, needs.normals, needs.emission};
    for (size_t look = 0; look < look_count; ++look) {
        for (uint32_t s = 0; s < squares && made[look]; ++s)
            baked.by_look[look].push_back(bake.run(s, static_cast<Look>(look), baked.brightest));
    }
    return baked;
}

namespace {

// What of an old material no texture says, with the textures of a square; its name is none.
Material shown(Material m, const BakedTextures& baked, const std::array<int32_t, look_count>& first, size_t square) {
    m.name.clear();
    m.base_colour = glm::vec4(1);
    for (Texture* texture : m.textures()) *texture = {};
    const auto image = [&](Look look) { return first[static_cast<size_t>(look)] + static_cast<int32_t>(square); };
    m.base_colour_texture.image = image(Look::colour);
    if (baked.metal) {
        m.metallic = m.roughness = 1;
        m.metallic_roughness_texture.image = image(Look::surface);
    }
    m.occlusion_strength = m.normal_scale = 1;
    if (baked.occlusion) m.occlusion_texture.image = image(Look::surface);
    if (!baked.of(Look::normals).empty()) m.normal_texture.image = image(Look::normals);
    if (!baked.of(Look::emission).empty()) {
        m.emission = glm::vec3(baked.brightest);
        m.emission_texture.image = image(Look::emission);
    }
    return m;
}

std::string name_of(const Material& m, size_t square) {
    std::string name = "texture" + std::to_string(square);
    if (m.double_sided) name += "-double-sided";
    if (m.alpha_mode != AlphaMode::opaque) name += m.alpha_mode == AlphaMode::mask ? "-mask" : "-blend";
    if (m.shading == Shading::unlit) name += "-unlit";
    return name;
}

}  // namespace

void use_textures(TriMesh& mesh, BakedTextures baked, const std::vector<Material>& before) {
    const size_t squares = baked.of(Look::colour).size(), materials = std::max<size_t>(1, before.size());
    std::array<int32_t, look_count> first{};
    std::vector<Image> images;
    for (size_t look = 0; look < look_count; ++look) {
        first[look] = static_cast<int32_t>(images.size());
        for (Image& image : baked.by_look[look]) images.push_back(std::move(image));
    }
    if (mesh.materials.empty()) mesh.materials.assign(mesh.wedge_count(), 0);
    std::vector<bool> used(squares * materials, false);
    for (const uint16_t m : mesh.materials) used[m] = true;
    std::vector<Material> table;
    std::vector<uint16_t> number(used.size(), 0);
    for (size_t old = 0; old < used.size(); ++old) {
        if (!used[old]) continue;
        const size_t square = old / materials;
        Material material = shown(before.empty() ? Material{} : before[old % materials], baked, first, square);
        material.name = name_of(material, square);
        const auto found = std::ranges::find(table, material);
        number[old] = static_cast<uint16_t>(found - table.begin());
        if (found == table.end()) table.push_back(std::move(material));
    }
    for (uint16_t& m : mesh.materials) m = number[m];
    mesh.material_table = std::move(table);
    mesh.images = std::move(images);
}

}  // namespace lodestone::vgi
