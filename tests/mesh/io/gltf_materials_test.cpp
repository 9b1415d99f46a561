// What is read of glTF's materials.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "fixtures/real_data.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class GltfMaterials : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_materials_" + std::to_string(::getpid()));
        fs::create_directories(folder_);
        for (int i = 0; i < 3; ++i) {
            const auto grey = static_cast<uint8_t>(50 + i);
            const Image image{2, 2, std::vector<glm::u8vec4>(4, {grey, grey, grey, 255})};
            EXPECT_TRUE(write_png(image, folder_ / (std::to_string(i) + ".png")));
        }
        // Two triangles' worth of numbers: positions, and two sets of texture coordinates.
        const float numbers[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0.5f, 0.5f, 0.5f, 0.25f, 0.25f, 0.5f};
        std::ofstream(folder_ / "a.bin", std::ios::binary)
            .write(reinterpret_cast<const char*>(numbers), sizeof numbers);
    }
    void TearDown() override { fs::remove_all(folder_); }

    // A triangle of one material; textures 0 .. 2 are images 0 .. 2.
    static json document(const json& material) {
        json doc = {{"asset", {{"version", "2.0"}}},
                    {"scene", 0},
                    {"scenes", {{{"nodes", {0}}}}},
                    {"nodes", {{{"mesh", 0}}}},
                    {"buffers", {{{"byteLength", 84}, {"uri", "a.bin"}}}},
                    {"materials", {material}},
                    {"textures", {{{"source", 0}}, {{"source", 1}}, {{"source", 2}}}},
                    {"images", {{{"uri", "0.png"}}, {{"uri", "1.png"}}, {{"uri", "2.png"}}}}};
        size_t offset = 0;
        for (const auto& [bytes, type] : {std::pair{36, "VEC3"}, {24, "VEC2"}, {24, "VEC2"}}) {
            doc["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}});
            doc["accessors"].push_back(
                {{"bufferView", doc["bufferViews"].size() - 1}, {"componentType", 5126}, {"count", 3}, {"type", type}});
            offset += static_cast<size_t>(bytes);
        }
        json primitive = {{"material", 0}};
        primitive["attributes"] = {{"POSITION", 0}, {"TEXCOORD_0", 1}, {"TEXCOORD_1", 2}};
        doc["meshes"] = {{{"primitives", {primitive}}}};
        return doc;
    }
    TriMesh read(const json& doc) {
        std::ofstream(folder_ / "a.gltf") << doc.dump();
        told_ = {};
        auto mesh = read_mesh(folder_ / "a.gltf", {}, &told_);
        EXPECT_TRUE(mesh) << mesh.error().message;
        if (!mesh) return {};
        EXPECT_TRUE(mesh->validate());
        EXPECT_EQ(mesh->material_table.size(), 2u);
        return std::move(*mesh);
    }
    Material material(const json& from) {
        const TriMesh mesh = read(document(from));
        return mesh.material_table.empty() ? Material{} : mesh.material_table.back();
    }
    static json transformed(int texture, const json& transform, int set = 0) {
        return {{"index", texture}, {"texCoord", set}, {"extensions", {{"KHR_texture_transform", transform}}}};
    }

    fs::path folder_;
    ReadReport told_;
};

void expect_near(const glm::mat3x2& a, const glm::mat3x2& b) {
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(a[k].x, b[k].x, 1e-6f) << k;
        EXPECT_NEAR(a[k].y, b[k].y, 1e-6f) << k;
    }
}

TEST_F(GltfMaterials, WhatIsNotSaidIsAsTheSpecificationSays) {
    const Material m = material(json::object());
    EXPECT_EQ(m.shading, Shading::metallic_roughness);
    EXPECT_EQ(m.metallic, 1);
    EXPECT_EQ(m.roughness, 1);
    EXPECT_EQ(m.normal_scale, 1);
    EXPECT_EQ(m.occlusion_strength, 1);
    EXPECT_EQ(m.emission, glm::vec3(0));
    EXPECT_EQ(m.alpha_mode, AlphaMode::opaque);
    for (const Texture* texture : m.textures()) EXPECT_FALSE(texture->there());
    EXPECT_THAT(told_.warnings, IsEmpty());
}

TEST_F(GltfMaterials, EveryMemberIsRead) {
    json doc = document({{"name", "all"},
                         {"pbrMetallicRoughness",
                          {{"baseColorFactor", {0.5, 0.25, 1, 0.75}},
                           {"metallicFactor", 0.5},
                           {"roughnessFactor", 0.25},
                           {"baseColorTexture", {{"index", 0}}},
                           {"metallicRoughnessTexture", {{"index", 1}}}}},
                         {"normalTexture", {{"index", 2}, {"scale", -2}}},
                         {"occlusionTexture", {{"index", 1}, {"strength", 0.5}}},
                         {"emissiveTexture", {{"index", 3}}},
                         {"emissiveFactor", {1, 0.5, 0}},
                         {"alphaMode", "MASK"},
                         {"alphaCutoff", 0.25},
                         {"doubleSided", true},
                         {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 4}}}}}});
    doc["extensionsUsed"] = {"KHR_materials_emissive_strength"};
    doc["textures"].push_back({{"source", 0}, {"sampler", 0}});
    doc["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}}};
    const TriMesh mesh = read(doc);
    ASSERT_EQ(mesh.images.size(), 3u) << "each once";
    const Material& m = mesh.material_table[1];
    EXPECT_EQ(m.base_colour, glm::vec4(0.5f, 0.25f, 1, 0.75f));
    EXPECT_EQ(m.metallic, 0.5f);
    EXPECT_EQ(m.roughness, 0.25f);
    EXPECT_EQ(m.normal_scale, -2);
    EXPECT_EQ(m.occlusion_strength, 0.5f);
    EXPECT_EQ(m.emission, glm::vec3(4, 2, 0));
    EXPECT_EQ(m.alpha_mode, AlphaMode::mask);
    EXPECT_EQ(m.alpha_cutoff, 0.25f);
    EXPECT_TRUE(m.double_sided);
    const auto grey = [&](const Texture& texture) {
        return mesh.images.at(static_cast<size_t>(texture.image)).texels[0].x;
    };
    EXPECT_EQ(grey(m.base_colour_texture), 50);
    EXPECT_EQ(grey(m.metallic_roughness_texture), 51);
    EXPECT_EQ(grey(m.normal_texture), 52);
    EXPECT_EQ(m.occlusion_texture.image, m.metallic_roughness_texture.image);
    EXPECT_EQ(m.emission_texture.image, m.base_colour_texture.image);
    EXPECT_THAT(m.emission_texture.wrap, ElementsAre(Wrap::clamp, Wrap::mirror));
    EXPECT_THAT(m.base_colour_texture.wrap, ElementsAre(Wrap::repeat, Wrap::repeat));
    EXPECT_THAT(told_.warnings, IsEmpty());
}

TEST_F(GltfMaterials, UnlitAndBlended) {
    json doc = document({{"alphaMode", "BLEND"}, {"extensions", {{"KHR_materials_unlit", json::object()}}}});
    doc["extensionsUsed"] = doc["extensionsRequired"] = {"KHR_materials_unlit"};
    const TriMesh mesh = read(doc);
    EXPECT_EQ(mesh.material_table[1].shading, Shading::unlit);
    EXPECT_EQ(mesh.material_table[1].alpha_mode, AlphaMode::blend);
    EXPECT_THAT(told_.warnings, IsEmpty());
}

TEST_F(GltfMaterials, NumbersOutOfRangeAreBroughtInto) {
    const Material m =
        material({{"pbrMetallicRoughness",
                   {{"baseColorFactor", {-1, 2, 1e300, 0.5}}, {"metallicFactor", -5}, {"roughnessFactor", 1e30}}},
                  {"normalTexture", {{"index", 0}, {"scale", 1e300}}},
                  {"occlusionTexture", {{"index", 0}, {"strength", -1}}},
                  {"emissiveFactor", {-1, 1e300, 1}},
                  {"alphaMode", "MASK"},
                  {"alphaCutoff", -3}});
    EXPECT_EQ(m.base_colour, glm::vec4(0, 1, 1, 0.5f));
    EXPECT_EQ(m.metallic, 0);
    EXPECT_EQ(m.roughness, 1);
    EXPECT_EQ(m.normal_scale, 65504);
    EXPECT_EQ(m.occlusion_strength, 0);
    EXPECT_EQ(m.emission, glm::vec3(0, 65504, 1));
    EXPECT_EQ(m.alpha_cutoff, 0);
    EXPECT_EQ(material({{"name", "odd\n"}, {"alphaMode", "HALF"}}).alpha_mode, AlphaMode::opaque);
    EXPECT_THAT(told_.warnings, ElementsAre(HasSubstr("material 'odd\\x0a' has an alphaMode")));
}

TEST_F(GltfMaterials, OtherTexturesStandWhereTheirTransformsSay) {
    const json base = {{"offset", {0.25, 0.5}}, {"rotation", 0.5}, {"scale", {2, 3}}};
    const json other = {{"offset", {-1, 0.125}}, {"rotation", -1.25}, {"scale", {0.5, -4}}};
    const TriMesh mesh = read(
        document({{"pbrMetallicRoughness",
                   {{"baseColorTexture", transformed(0, base)}, {"metallicRoughnessTexture", transformed(1, base)}}},
                  {"normalTexture", transformed(2, other)},
                  {"emissiveTexture", {{"index", 0}}}}));
    const Material& m = mesh.material_table[1];
    EXPECT_EQ(m.base_colour_texture.place, Texture{}.place);
    EXPECT_EQ(m.metallic_roughness_texture.place, Texture{}.place) << "exactly, where transforms are equal";
    // The corners of the triangle are at (0, 0), (1, 0), (0, 1) in the file.
    const glm::dvec2 corners[] = {{0, 0}, {1, 0}, {0, 1}};
    for (size_t k = 0; k < 3; ++k) {
        const glm::dvec2 scaled = corners[k] * glm::dvec2(0.5, -4);
        const double c = std::cos(-1.25), s = std::sin(-1.25);
        const glm::vec2 expected(c * scaled.x + s * scaled.y - 1, c * scaled.y - s * scaled.x + 0.125);
        const glm::vec2 at = m.normal_texture.place * glm::vec3(mesh.uvs[k], 1),
                        plain = m.emission_texture.place * glm::vec3(mesh.uvs[k], 1);
        EXPECT_NEAR(at.x, expected.x, 1e-5f);
        EXPECT_NEAR(at.y, expected.y, 1e-5f);
        EXPECT_NEAR(plain.x, corners[k].x, 1e-6);
        EXPECT_NEAR(plain.y, corners[k].y, 1e-6);
    }
    EXPECT_THAT(told_.warnings, IsEmpty());
}

TEST_F(GltfMaterials, WithoutABaseColourTheFirstTextureSaysWhereAllAre) {
    const TriMesh mesh = read(document({{"normalTexture", transformed(0, {{"scale", {2, 2}}}, 1)},
                                        {"occlusionTexture", {{"index", 1}, {"texCoord", 1}}}}));
    EXPECT_EQ(mesh.uvs[0], glm::vec2(1, 1)) << "TEXCOORD_1, twice";
    EXPECT_EQ(mesh.material_table[1].normal_texture.place, Texture{}.place);
    expect_near(mesh.material_table[1].occlusion_texture.place, {{0.5f, 0}, {0, 0.5f}, {0, 0}});
}

TEST_F(GltfMaterials, WhatCannotGoWithTheFirstTextureIsLeftOutByName) {
    const json base = {{"index", 0}};
    Material m =
        material({{"name", "three"},
                  {"pbrMetallicRoughness",
                   {{"baseColorTexture", base}, {"metallicRoughnessTexture", {{"index", 1}, {"texCoord", 2}}}}},
                  {"normalTexture", {{"index", 1}, {"texCoord", 2}}},
                  {"emissiveFactor", {1, 1, 1}},
                  {"emissiveTexture", {{"index", 1}, {"texCoord", 1}}}});
    EXPECT_TRUE(m.base_colour_texture.there());
    EXPECT_TRUE(m.metallic_roughness_texture.there()) << "the first texture on another set says which the second is";
    EXPECT_TRUE(m.normal_texture.there());
    EXPECT_FALSE(m.emission_texture.there());
    EXPECT_EQ(m.emission, glm::vec3(0));
    EXPECT_THAT(told_.warnings,
                ElementsAre(HasSubstr("material 'three': its texture of emission is left out: it lies on TEXCOORD_1, "
                                      "others of the material on TEXCOORD_0 and TEXCOORD_2; two sets are read"),
                            HasSubstr("have no TEXCOORD_2")));
    m = material({{"pbrMetallicRoughness", {{"baseColorTexture", transformed(0, {{"scale", {0, 1}}})}}},
                  {"normalTexture", {{"index", 1}}},
                  {"occlusionTexture", transformed(1, {{"scale", {0, 1}}})}});
    EXPECT_TRUE(m.base_colour_texture.there());
    EXPECT_TRUE(m.occlusion_texture.there());
    EXPECT_FALSE(m.normal_texture.there());
    EXPECT_THAT(told_.warnings, ElementsAre(HasSubstr("the transform of base colour cannot be undone")));
    // Numbers that no picture has.
    material({{"pbrMetallicRoughness", {{"baseColorTexture", base}}},
              {"normalTexture", transformed(1, {{"scale", {1e300, 1}}, {"texCoord", 1e300}})}});
    EXPECT_EQ(told_.warnings.size(), 1u);
    material({{"pbrMetallicRoughness", {{"baseColorTexture", base}}},
              {"normalTexture", transformed(1, {{"scale", {1e300, 1}}}, 1)}});
    EXPECT_THAT(told_.warnings, ElementsAre(HasSubstr("its transform has numbers that are too large")));
}

TEST_F(GltfMaterials, OtherTexturesMayLieOnASecondSet) {
    const json moved = {{"offset", {0.25, 0}}, {"scale", {2, -1}}};
    const TriMesh mesh = read(document({{"pbrMetallicRoughness", {{"baseColorTexture", transformed(0, moved)}}},
                                        {"normalTexture", {{"index", 1}, {"texCoord", 1}}},
                                        {"occlusionTexture", transformed(1, moved, 1)},
                                        {"emissiveFactor", {1, 1, 1}},
                                        {"emissiveTexture", {{"index", 2}}}}));
    const Material& m = mesh.material_table[1];
    EXPECT_THAT(mesh.uvs, ElementsAre(glm::vec2(0.25f, 0), glm::vec2(2.25f, 0), glm::vec2(0.25f, -1)));
    EXPECT_THAT(mesh.second_uvs, ElementsAre(glm::vec2(0.5f, 0.5f), glm::vec2(0.5f, 0.25f), glm::vec2(0.25f, 0.5f)))
        << "as they are in the file";
    EXPECT_FALSE(m.base_colour_texture.second);
    EXPECT_TRUE(m.normal_texture.second);
    EXPECT_EQ(m.normal_texture.place, Texture{}.place);
    EXPECT_TRUE(m.occlusion_texture.second);
    expect_near(m.occlusion_texture.place, {{2, 0}, {0, -1}, {0.25f, 0}});
    EXPECT_FALSE(m.emission_texture.second);
    expect_near(m.emission_texture.place, {{0.5f, 0}, {0, -1}, {-0.125f, 0}});
    EXPECT_THAT(told_.warnings, IsEmpty());
}

TEST_F(GltfMaterials, TheFirstSetIsThatOfTheBaseColourWhateverItsNumber) {
    const TriMesh mesh =
        read(document({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}, {"texCoord", 1}}}}},
                       {"occlusionTexture", {{"index", 1}}}}));
    EXPECT_EQ(mesh.uvs[0], glm::vec2(0.5f, 0.5f));
    EXPECT_EQ(mesh.second_uvs[1], glm::vec2(1, 0));
    EXPECT_TRUE(mesh.material_table[1].occlusion_texture.second);
}

TEST_F(GltfMaterials, PrimitivesWithoutASecondSetHaveZerosWhereOthersHaveOne) {
    json doc = document({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
                         {"occlusionTexture", {{"index", 1}, {"texCoord", 1}}}});
    json& primitives = doc["meshes"][0]["primitives"];
    json plain = primitives[0];
    plain.erase("material");
    primitives = {plain, primitives[0], plain};
    TriMesh mesh = read(doc);
    ASSERT_EQ(mesh.second_uvs.size(), 9u);
    EXPECT_EQ(mesh.second_uvs[0], glm::vec2(0));
    EXPECT_EQ(mesh.second_uvs[3], glm::vec2(0.5f, 0.5f));
    EXPECT_EQ(mesh.second_uvs[8], glm::vec2(0));
    // Where no texture is on it, a set is not read.
    primitives = json::array({plain});
    EXPECT_THAT(read(doc).second_uvs, IsEmpty());
    // Without a first set there is one of zeros, so that the second can be.
    plain["material"] = 0;
    plain["attributes"].erase("TEXCOORD_0");
    primitives = json::array({plain});
    mesh = read(doc);
    EXPECT_THAT(mesh.uvs, ElementsAre(glm::vec2(0), glm::vec2(0), glm::vec2(0)));
    EXPECT_EQ(mesh.second_uvs.size(), 3u);
}

TEST_F(GltfMaterials, ASecondSetOfAnotherLengthIsRefusedByName) {
    json doc = document({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
                         {"occlusionTexture", {{"index", 1}, {"texCoord", 1}}}});
    const auto said = [&](int count) {
        doc["accessors"][2]["count"] = count;
        std::ofstream(folder_ / "a.gltf") << doc.dump();
        const auto mesh = read_mesh(folder_ / "a.gltf");
        return mesh ? "nothing" : mesh.error().message;
    };
    EXPECT_EQ(said(3), "nothing");
    EXPECT_THAT(said(2), HasSubstr("has another number of texture coordinates than of positions"));
    EXPECT_THAT(said(3000000), HasSubstr("TEXCOORD_1"));
}

TEST_F(GltfMaterials, ImagesThatAreNotThereTakeTheirEmissionAndMetalAlong) {
    fs::remove(folder_ / "1.png");
    const Material m = material({{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 1}}}}},
                                 {"emissiveFactor", {1, 1, 1}},
                                 {"emissiveTexture", {{"index", 7}}}});
    EXPECT_EQ(m.metallic, 0);
    EXPECT_EQ(m.roughness, 1);
    EXPECT_EQ(m.emission, glm::vec3(0));
    EXPECT_THAT(told_.warnings, testing::UnorderedElementsAre(HasSubstr("1.png"),
                                                              HasSubstr("its texture of emission is left out: texture "
                                                                        "7 is not there; the file has 3")));
}

TEST_F(GltfMaterials, TexturesWithoutAnImageThatIsReadAreToldOfByName) {
    const json colour = {
        {"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0, 1}}, {"baseColorTexture", {{"index", 0}}}}}};
    const auto avif = [](int source) {
        return json{{"name", "wall"}, {"extensions", {{"EXT_texture_avif", {{"source", source}}}}}};
    };
    json doc = document(colour);
    doc["extensionsUsed"] = {"EXT_texture_avif"};
    for (const auto& [texture, line] :
         {std::pair{json{{"source", 9}}, "texture '0' cannot be used (image 9 is not there; the file has 3)"},
          {json{{"sampler", 0}}, "texture '0' cannot be used (it names no image)"},
          {avif(0), "texture 'wall' has its image by EXT_texture_avif alone, which is not read"}}) {
        doc["textures"][0] = texture;
        const TriMesh mesh = read(doc);
        EXPECT_THAT(told_.warnings, testing::Contains(AllOf(HasSubstr(line), HasSubstr("plain colour"))).Times(1));
        EXPECT_THAT(told_.warnings, testing::Contains(HasSubstr("EXT_texture_avif")).Times(1));
        EXPECT_TRUE(mesh.images.empty());
        EXPECT_EQ(mesh.material_table.back().base_colour, glm::vec4(1, 0.5f, 0, 1));
    }
    doc["textures"][0]["source"] = 2;
    EXPECT_EQ(read(doc).images.size(), 1u) << "what is beside it is read";
    EXPECT_THAT(told_.warnings, ElementsAre(HasSubstr("uses the extension EXT_texture_avif, which is left out")));
}

TEST_F(GltfMaterials, ARequiredExtensionOfImagesIsOneLineHoweverManyTexturesHaveIt) {
    json doc = document({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
                         {"normalTexture", {{"index", 1}}},
                         {"occlusionTexture", {{"index", 2}}}});
    for (json& texture : doc["textures"]) texture = {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}};
    doc["extensionsUsed"] = doc["extensionsRequired"] = {"KHR_texture_basisu"};
    read(doc);
    EXPECT_THAT(told_.warnings, ElementsAre(HasSubstr("texture '0' and 2 more have their images by KHR_texture_basisu "
                                                      "alone, which is not read; their materials keep their plain")));
}

TEST_F(GltfMaterials, ImagesOfNoOrOfTooManyTexelsLeaveThePlainColour) {
    const std::string path = (folder_ / "0.png").string();
    std::ifstream in(path, std::ios::binary);
    std::string image{std::istreambuf_iterator<char>(in), {}};
    for (const auto& [size, what] : {std::pair{std::string(8, '\0'), "PNG: "},
                                     {std::string("\0\1\0\0\0\1\0\0", 8), "is 65536x65536 texels; the limit is"}}) {
        image.replace(16, 8, size);
        const auto sum = static_cast<uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(image.data()) + 12, 17));
        for (int k = 0; k < 4; ++k) image[29 + static_cast<size_t>(k)] = static_cast<char>(sum >> (24 - 8 * k));
        std::ofstream(path, std::ios::binary) << image;
        const Material m = material(
            {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0, 1}}, {"baseColorTexture", {{"index", 0}}}}}});
        EXPECT_THAT(told_.warnings, ElementsAre(AllOf(HasSubstr("texture '0.png' cannot be used"), HasSubstr(what),
                                                      HasSubstr("its material keeps its plain colour"))));
        EXPECT_FALSE(m.base_colour_texture.there());
        EXPECT_EQ(m.base_colour, glm::vec4(1, 0.5f, 0, 1));
    }
}

TEST_F(GltfMaterials, ExtensionsThatAreNotReadAreToldOnceByName) {
    json doc = document(json::object());
    doc["extensionsUsed"] = {"KHR_materials_transmission", "KHR_materials_unlit", "KHR_materials_emissive_strength",
                             "KHR_texture_transform", "KHR_materials_clearcoat"};
    doc["extensionsRequired"] = {"KHR_materials_clearcoat"};
    read(doc);
    EXPECT_THAT(told_.warnings,
                testing::UnorderedElementsAre(HasSubstr("requires the extension KHR_materials_clearcoat"),
                                              HasSubstr("uses the extension KHR_materials_transmission")));
}

TEST(Images, OfPngHaveItsNumbersWhateverItsGammaIs) {
    for (const bool wide : {false, true}) {
        for (const double gamma : {0.0, 0.2, 1.0}) {
            std::vector<std::byte> file;
            png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
            png_infop info = png_create_info_struct(png);
            png_set_write_fn(
                png, &file,
                [](png_structp to, png_bytep bytes, size_t size) {
                    auto* into = static_cast<std::vector<std::byte>*>(png_get_io_ptr(to));
                    const auto* from = reinterpret_cast<const std::byte*>(bytes);
                    into->insert(into->end(), from, from + size);
                },
                nullptr);
            png_set_IHDR(png, info, 2, 1, wide ? 16 : 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                         PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
            if (gamma > 0) png_set_gAMA(png, info, gamma);
            png_write_info(png, info);
            const std::array<uint8_t, 6> narrow = {128, 127, 255, 0, 30, 200};
            std::array<uint8_t, 12> row{};
            for (size_t i = 0; i < 6; ++i) row[wide ? 2 * i : i] = row[wide ? 2 * i + 1 : i] = narrow[i];
            png_write_row(png, row.data());
            png_write_end(png, nullptr);
            png_destroy_write_struct(&png, &info);
            const auto image = decode_image(file, "a.png");
            ASSERT_TRUE(image) << image.error().message;
            EXPECT_THAT(image->texels, ElementsAre(glm::u8vec4(128, 127, 255, 255), glm::u8vec4(0, 30, 200, 255)))
                << wide << " " << gamma;
        }
    }
}

// Khronos' own test files.
struct Sample {
    std::string path;
    std::string feature;  // of which some material has it
    std::vector<std::string> warnings;
};

class GltfMaterialSample : public testing::TestWithParam<Sample> {};

bool has(const Material& m, const std::string& feature) {
    const auto& textures = m.textures();
    const auto any = [&](auto&& test) { return std::ranges::any_of(textures, test); };
    if (feature == "unlit") return m.shading == Shading::unlit;
    if (feature == "blend") return m.alpha_mode == AlphaMode::blend;
    if (feature == "wrap") return any([](const Texture* t) { return t->wrap[0] == Wrap::mirror; });
    if (feature == "strength") return m.emission.x > 1 || m.emission.y > 1 || m.emission.z > 1;
    if (feature == "normals") return m.normal_texture.there();
    if (feature == "second set") return any([](const Texture* t) { return t->there() && t->second; });
    if (feature == "all") return std::ranges::all_of(textures, [](const Texture* t) { return t->there(); });
    return feature.empty();
}

TEST_P(GltfMaterialSample, IsReadWithWhatItShows) {
    const Sample& sample = GetParam();
    const auto path = fixtures::real_data(sample.path);
    if (!path) GTEST_SKIP() << fixtures::missing_data_note(sample.path);
    ReadReport told;
    const auto mesh = read_mesh(*path, {}, &told);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(mesh->validate());
    EXPECT_TRUE(std::ranges::any_of(mesh->material_table, [&](const Material& m) { return has(m, sample.feature); }));
    ASSERT_EQ(told.warnings.size(), sample.warnings.size()) << testing::PrintToString(told.warnings);
    for (size_t i = 0; i < sample.warnings.size(); ++i) EXPECT_THAT(told.warnings[i], HasSubstr(sample.warnings[i]));
}

INSTANTIATE_TEST_SUITE_P(
    Data, GltfMaterialSample,
    testing::Values(
        Sample{"materials/UnlitTest/UnlitTest.glb", "unlit", {}},
        Sample{"materials/AlphaBlendModeTest/AlphaBlendModeTest.glb", "blend", {}},
        Sample{"materials/TextureSettingsTest/TextureSettingsTest.glb", "wrap", {}},
        Sample{"materials/TextureTransformTest/TextureTransformTest.gltf", "", {}},
        Sample{"materials/TextureTransformMultiTest/TextureTransformMultiTest.glb", "", {"KHR_materials_clearcoat"}},
        Sample{"materials/EmissiveStrengthTest/EmissiveStrengthTest.glb", "strength", {}},
        Sample{"materials/NormalTangentTest/NormalTangentTest.glb", "normals", {}},
        Sample{"materials/MultiUVTest/MultiUVTest.glb", "second set", {}},
        Sample{"gltf/DamagedHelmet/DamagedHelmet.glb", "all", {}},
        Sample{"gltf/ToyCar/ToyCar.gltf", "normals", {"clearcoat", "transmission", "sheen"}}),
    [](const auto& of) { return fixtures::test_name_of(of.param.path); });

}  // namespace
}  // namespace lodestone
