#include "mesh/io/material_chunks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "base/json.h"
#include "base/text.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace {

// Names of an enumeration's values, in their order.
constexpr std::array<const char*, 3> wrap_names = {"repeat", "clamp", "mirror"};
constexpr std::array<const char*, 3> shading_names = {"plain", "metallic_roughness", "unlit"};
constexpr std::array<const char*, 3> alpha_names = {"opaque", "mask", "blend"};

template <class Enum>
Enum named(const std::array<const char*, 3>& names, const Json& json) {
    const auto name = json.get<std::string>();
    const auto* found = std::ranges::find(names, name);
    if (found == names.end()) throw std::out_of_range("has the unknown word '" + name.substr(0, 40) + "'");
    return static_cast<Enum>(found - names.begin());
}

float number(const Json& json) {
    const auto value = json.get<float>();
    if (!std::isfinite(value)) throw std::out_of_range("has a number that is not finite");
    return value;
}

Json to_json(const Texture& t) {
    if (!t.there()) return nullptr;
    return {{"image", t.image},
            {"wrap", {wrap_names[static_cast<size_t>(t.wrap[0])], wrap_names[static_cast<size_t>(t.wrap[1])]}},
            {"place", {t.place[0].x, t.place[0].y, t.place[1].x, t.place[1].y, t.place[2].x, t.place[2].y}},
            {"second", t.second}};
}

Json to_json(const Material& m) {
    Json textures = Json::array();
    for (const Texture* texture : m.textures()) textures.push_back(to_json(*texture));
    return {{"name", m.name},
            {"base_colour", {m.base_colour.x, m.base_colour.y, m.base_colour.z, m.base_colour.w}},
            {"shading", shading_names[static_cast<size_t>(m.shading)]},
            {"alpha", alpha_names[static_cast<size_t>(m.alpha_mode)]},
            {"alpha_cutoff", m.alpha_cutoff},
            {"double_sided", m.double_sided},
            {"metallic", m.metallic},
            {"roughness", m.roughness},
            {"normal_scale", m.normal_scale},
            {"occlusion_strength", m.occlusion_strength},
            {"emission", {m.emission.x, m.emission.y, m.emission.z}},
            {"textures", textures}};
}

Texture texture_from(const Json& json, size_t images) {
    Texture t;
    if (json.is_null()) return t;
    const auto image = json.at("image").get<int64_t>();
    if (image < 0 || image >= static_cast<int64_t>(images)) throw std::out_of_range("has no such image");
    t.image = static_cast<int32_t>(image);
    for (size_t k = 0; k < 2; ++k) t.wrap[k] = named<Wrap>(wrap_names, json.at("wrap").at(k));
    for (size_t k = 0; k < 6; ++k)
        t.place[static_cast<int>(k / 2)][static_cast<int>(k % 2)] = number(json.at("place").at(k));
    t.second = json.at("second").get<bool>();
    return t;
}

Material material_from(const Json& json, size_t images) {
    Material m;
    m.name = json.at("name").get<std::string>();
    try {
        for (int k = 0; k < 4; ++k) m.base_colour[k] = number(json.at("base_colour").at(static_cast<size_t>(k)));
        m.shading = named<Shading>(shading_names, json.at("shading"));
        m.alpha_mode = named<AlphaMode>(alpha_names, json.at("alpha"));
        m.alpha_cutoff = number(json.at("alpha_cutoff"));
        m.double_sided = json.at("double_sided").get<bool>();
        m.metallic = number(json.at("metallic"));
        m.roughness = number(json.at("roughness"));
        m.normal_scale = number(json.at("normal_scale"));
        m.occlusion_strength = number(json.at("occlusion_strength"));
        for (int k = 0; k < 3; ++k) m.emission[k] = number(json.at("emission").at(static_cast<size_t>(k)));
        const auto textures = m.textures();
        for (size_t k = 0; k < textures.size(); ++k) *textures[k] = texture_from(json.at("textures").at(k), images);
        if (m.base_colour_texture.second) throw std::out_of_range("has a base colour on the second set");
    } catch (const std::out_of_range& e) {
        throw std::out_of_range("material '" + printable(m.name.substr(0, 80)) + "' " + e.what());
    }
    return m;
}

std::string image_chunk(size_t i) { return "mesh/image/" + std::to_string(i); }

}  // namespace

Result<void> write_materials(ChunkWriter& writer, const std::vector<Material>& table,
                             const std::vector<Image>& images) {
    if (writer.contains("mesh/materials")) return {};
    Json json = {{"materials", Json::array()}, {"images", images.size()}};
    for (const Material& m : table) json["materials"].push_back(to_json(m));
    Result<void> done = writer.add_text("mesh/materials", json.dump());
    for (size_t i = 0; i < images.size() && done; ++i) {
        auto png = encode_png(images[i]);
        if (!png) return tl::unexpected(png.error());
        done = writer.add(image_chunk(i), *png);
    }
    return done;
}

Result<MaterialChunks> read_materials(const ChunkFile& file) {
    const std::string path = file.path().string();
    auto text = file.text("mesh/materials");
    if (!text) return tl::unexpected(text.error());
    MaterialChunks result;
    size_t image_count = 0;
    const auto wrong = [&](const std::string& what) {
        return fail_at(path, {Fault::format, "mesh/materials: " + what + "; bake the asset again"});
    };
    try {
        const Json json = Json::parse(*text);
        image_count = json.at("images").get<size_t>();
        for (const Json& m : json.at("materials")) result.table.push_back(material_from(m, image_count));
    } catch (const Json::exception& e) { return wrong(e.what()); } catch (const std::out_of_range& e) {
        return wrong(e.what());
    }
    for (size_t i = 0; i < image_count; ++i) {
        auto png = file.bytes(image_chunk(i));
        if (!png) return tl::unexpected(png.error());
        auto image = decode_image(*png, path + ": " + image_chunk(i));
        if (!image) return tl::unexpected(image.error());
        result.images.push_back(std::move(*image));
    }
    return result;
}

}  // namespace lodestone
