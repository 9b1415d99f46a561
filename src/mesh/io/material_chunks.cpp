#include "mesh/io/material_chunks.h"

#include "base/json.h"
#include "mesh/io/image_file.h"

namespace lodestone {

namespace {

Json to_json(const Material& m) {
    return {{"name", m.name},
            {"base_colour", {m.base_colour.x, m.base_colour.y, m.base_colour.z, m.base_colour.w}},
            {"image", m.base_colour_texture.image},
            {"double_sided", m.double_sided}};
}

Material material_from(const Json& json) {
    Material m;
    m.name = json.at("name").get<std::string>();
    for (int k = 0; k < 4; ++k) m.base_colour[k] = json.at("base_colour").at(static_cast<size_t>(k)).get<float>();
    m.base_colour_texture.image = json.at("image").get<int32_t>();
    m.double_sided = json.at("double_sided").get<bool>();
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
    try {
        const Json json = Json::parse(*text);
        for (const Json& m : json.at("materials")) result.table.push_back(material_from(m));
        image_count = json.at("images").get<size_t>();
    } catch (const Json::exception& e) {
        return fail_at(path, {Fault::format, std::string("mesh/materials: ") + e.what() + "; bake the asset again"});
    }
    for (const Material& m : result.table) {
        if (m.base_colour_texture.image >= static_cast<int64_t>(image_count)) {
            return fail_at(path, {Fault::format,
                                  "mesh/materials: material '" + m.name + "' has no such image; bake the asset again"});
        }
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
