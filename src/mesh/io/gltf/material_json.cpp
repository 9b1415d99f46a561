#include "mesh/io/gltf/material_json.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <map>
#include <utility>

#include "base/text.h"

namespace lodestone {

namespace {

constexpr int clamp_to_edge = 33071, mirrored_repeat = 33648, repeated = 10497;

// As KHR_texture_transform has it: scaled, then turned, then moved.
struct Transform {
    glm::dvec2 offset{0}, scale{1};
    double rotation = 0;
};

std::optional<Transform> transform_of(const glm::dmat3x2& place) {
    const glm::dvec2 &a = place[0], &b = place[1];
    if (a.y == 0 && b.x == 0) return Transform{place[2], {a.x, b.y}, 0};
    const double lengths = glm::length(a) * glm::length(b);
    if (!(std::abs(glm::dot(a, b)) <= 1e-5 * lengths)) return std::nullopt;
    // a is its scale times (c, -s), b times (s, c).
    const double angle = glm::length(a) > 0 ? std::atan2(-a.y, a.x) : std::atan2(b.x, b.y);
    const double c = std::cos(angle), s = std::sin(angle);
    return Transform{place[2], {a.x * c - a.y * s, b.x * s + b.y * c}, angle};
}

class MaterialWriter {
public:
    explicit MaterialWriter(const WrittenTexcoords& texcoords) : texcoords_(texcoords) {}

    void add(Material m) {
        for (Texture* texture : m.textures()) {
            const bool placed = texture->second ? texcoords_.second : texcoords_.first.has_value();
            if (texture->there() && (!placed || !transform_of(glm::dmat3x2(texture->place)))) leave_out(m, *texture);
        }
        Json json = {{"pbrMetallicRoughness", pbr(m)}, {"doubleSided", m.double_sided}};
        if (!m.name.empty()) json["name"] = m.name;
        if (m.normal_texture.there()) {
            json["normalTexture"] = info(m.normal_texture);
            if (m.normal_scale != 1) json["normalTexture"]["scale"] = m.normal_scale;
        }
        if (m.occlusion_texture.there()) {
            json["occlusionTexture"] = info(m.occlusion_texture);
            if (m.occlusion_strength != 1) json["occlusionTexture"]["strength"] = m.occlusion_strength;
        }
        add_emission(json, m);
        if (m.alpha_mode != AlphaMode::opaque) json["alphaMode"] = m.alpha_mode == AlphaMode::mask ? "MASK" : "BLEND";
        if (m.alpha_mode == AlphaMode::mask) json["alphaCutoff"] = m.alpha_cutoff;
        if (m.shading == Shading::unlit) {
            json["extensions"]["KHR_materials_unlit"] = Json::object();
            made_.extensions.insert("KHR_materials_unlit");
        }
        made_.materials.push_back(std::move(json));
    }
    MaterialJson take() { return std::move(made_); }

private:
    Json pbr(const Material& m) {
        const bool plain = m.shading == Shading::plain;
        const glm::vec4& c = m.base_colour;
        Json json = {{"baseColorFactor", {c.x, c.y, c.z, c.w}},
                     {"metallicFactor", plain ? 0 : m.metallic},
                     {"roughnessFactor", plain ? 1 : m.roughness}};
        if (m.base_colour_texture.there()) json["baseColorTexture"] = info(m.base_colour_texture);
        if (m.metallic_roughness_texture.there() && !plain)
            json["metallicRoughnessTexture"] = info(m.metallic_roughness_texture);
        return json;
    }

    // Factors are within 0 .. 1, what is more is strength.
    void add_emission(Json& json, const Material& m) {
        if (m.emission_texture.there()) json["emissiveTexture"] = info(m.emission_texture);
        if (m.emission == glm::vec3(0)) return;
        const float strength = std::max({m.emission.x, m.emission.y, m.emission.z, 1.0f});
        const glm::vec3 factor = m.emission / strength;
        json["emissiveFactor"] = {factor.x, factor.y, factor.z};
        if (strength == 1) return;
        json["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = strength;
        made_.extensions.insert("KHR_materials_emissive_strength");
    }

    Json info(const Texture& texture) {
        Json json = {{"index", number_of(texture)}};
        if (texture.second) json["texCoord"] = 1;
        const auto whole = [](const glm::dmat3x2& m) {
            return glm::dmat3(glm::dvec3(m[0], 0), glm::dvec3(m[1], 0), glm::dvec3(m[2], 1));
        };
        const glm::dmat3x2 place(texture.place);
        const auto transform = transform_of(texture.second ? place : place * whole(*texcoords_.first));
        if (!transform) return json;
        Json members = Json::object();
        if (transform->offset != glm::dvec2(0)) members["offset"] = {transform->offset.x, transform->offset.y};
        if (transform->scale != glm::dvec2(1)) members["scale"] = {transform->scale.x, transform->scale.y};
        if (transform->rotation != 0) members["rotation"] = transform->rotation;
        if (members.empty()) return json;
        json["extensions"]["KHR_texture_transform"] = std::move(members);
        made_.extensions.insert("KHR_texture_transform");
        return json;
    }

    size_t number_of(const Texture& texture) {
        const auto [found, fresh] =
            textures_.try_emplace({texture.image, texture.wrap}, static_cast<size_t>(made_.textures.size()));
        if (fresh) {
            made_.textures.push_back({{"source", texture.image}});
            if (texture.wrap != Texture{}.wrap) made_.textures.back()["sampler"] = sampler_of(texture.wrap);
        }
        return found->second;
    }

    size_t sampler_of(const std::array<Wrap, 2>& wrap) {
        const auto [found, fresh] = samplers_.try_emplace(wrap, static_cast<size_t>(made_.samplers.size()));
        const auto word = [](Wrap w) {
            return w == Wrap::clamp ? clamp_to_edge : w == Wrap::mirror ? mirrored_repeat : repeated;
        };
        if (fresh) made_.samplers.push_back({{"wrapS", word(wrap[0])}, {"wrapT", word(wrap[1])}});
        return found->second;
    }

    const WrittenTexcoords& texcoords_;
    MaterialJson made_;
    std::map<std::pair<int32_t, std::array<Wrap, 2>>, size_t> textures_;
    std::map<std::array<Wrap, 2>, size_t> samplers_;
};

}  // namespace

MaterialJson material_json(std::span<const Material> table, const WrittenTexcoords& texcoords) {
    MaterialWriter writer(texcoords);
    for (const Material& material : table) writer.add(material);
    return writer.take();
}

std::vector<std::string> unwritable_textures(std::span<const Material> table) {
    std::vector<std::string> lines;
    for (const Material& material : table) {
        for (size_t k = 0; k < texture_names.size(); ++k) {
            const Texture& texture = *material.textures()[k];
            if (!texture.there() || transform_of(glm::dmat3x2(texture.place))) continue;
            lines.push_back("material '" + printable(material.name.substr(0, 80)) + "': its texture of " +
                            texture_names[k] + " is left out: glTF has no transform that would place it");
        }
    }
    return lines;
}

void add_to_document(Json& document, MaterialJson made) {
    if (!made.textures.empty()) document["textures"] = std::move(made.textures);
    if (!made.samplers.empty()) document["samplers"] = std::move(made.samplers);
    document["materials"] = std::move(made.materials);
}

}  // namespace lodestone
