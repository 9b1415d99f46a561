// TANGENT of glTF: read where maps of normals use it, in every encoding, moved with its node.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "fixtures/gltf_files.h"
#include "fixtures/real_data.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int signed_byte = 5120, signed_short = 5122, unsigned_short = 5123, real = 5126;

// A triangle in the plane z = 0 that looks towards +z, with a map of normals.
class GltfTangents : public testing::Test {
protected:
    GltfTangents() {
        doc_ = {{"asset", {{"version", "2.0"}}}, {"scene", 0},
                {"scenes", {{{"nodes", {0}}}}},  {"nodes", {{{"mesh", 0}}}},
                {"textures", {{{"source", 0}}}}, {"materials", {{{"normalTexture", {{"index", 0}}}}, json::object()}}};
        const auto png = encode_png({1, 1, {glm::u8vec4(128, 128, 255, 255)}});
        doc_["images"] = {{{"bufferView", view(std::span(*png))}, {"mimeType", "image/png"}}};
        put("POSITION", std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, real, "VEC3");
        put("NORMAL", std::vector<glm::vec3>(3, glm::vec3(0, 0, 1)), real, "VEC3");
        put("TEXCOORD_0", std::vector<glm::vec2>{{0, 0}, {1, 0}, {0, 1}}, real, "VEC2");
    }
    void SetUp() override {
        path_ = fs::temp_directory_path() / ("lodestone_tangents_" + std::to_string(::getpid()) + ".glb");
    }
    void TearDown() override { fs::remove(path_); }

    template <class T>
    size_t view(std::span<T> values) {
        bin_.resize((bin_.size() + 3) / 4 * 4);
        doc_["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", bin_.size()}, {"byteLength", values.size_bytes()}});
        bin_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
        return doc_["bufferViews"].size() - 1;
    }
    json& primitive() { return doc_["meshes"][0]["primitives"][0]; }
    // As attribute `name` of the primitive. Returns its accessor.
    template <class T>
    json& put(const char* name, const std::vector<T>& values, int component, const char* type) {
        json accessor = {{"bufferView", view(std::span(values))},
                         {"componentType", component},
                         {"count", values.size()},
                         {"type", type}};
        if (component != real) accessor["normalized"] = true;
        doc_["accessors"].push_back(accessor);
        primitive()["attributes"][name] = doc_["accessors"].size() - 1;
        primitive()["material"] = 0;
        return doc_["accessors"].back();
    }
    Result<TriMesh> tried() {
        doc_["buffers"] = {{{"byteLength", bin_.size()}}};
        std::ofstream(path_, std::ios::binary) << fixtures::glb_of(doc_, bin_);
        return read_mesh(path_);
    }
    TriMesh read() {
        auto mesh = tried();
        EXPECT_TRUE(mesh) << mesh.error().message;
        if (!mesh) return {};
        EXPECT_TRUE(mesh->validate()) << mesh->validate().error().message;
        return std::move(*mesh);
    }

    fs::path path_;
    json doc_;
    std::string bin_;
};

// Quarters of a turn from what texture coordinates tell.
const std::vector<glm::vec4> turned{{0, 1, 0, 1}, {0, 1, 0, -1}, {0, -1, 0, 1}};

TEST_F(GltfTangents, AreThoseOfTheFile) {
    put("TANGENT", turned, real, "VEC4");
    EXPECT_EQ(read().tangents, turned);
}

TEST_F(GltfTangents, AreOfUnitLengthOrNone) {
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
    const auto becomes = [&](const glm::vec4& tangent) {
        auto& document = doc_;
        const json before = document;
        put("TANGENT", std::vector<glm::vec4>{tangent, {0, 1, 0, 1}, {0, 1, 0, 1}}, real, "VEC4");
        const TriMesh mesh = read();
        document = before;
        return mesh.tangents.size() == 3 ? mesh.tangents[0] : glm::vec4(nan);
    };
    EXPECT_EQ(becomes({0, -3, 4, 1}), glm::vec4(0, -0.6f, 0.8f, 1));
    EXPECT_EQ(becomes({1e-30f, 0, 0, -0.25f}), glm::vec4(1, 0, 0, -1));
    EXPECT_EQ(becomes({3e38f, 0, 0, 1e30f}), glm::vec4(1, 0, 0, 1));
    for (const glm::vec4& wrong : {glm::vec4(0, 0, 0, 1), glm::vec4(1, 0, 0, 0), glm::vec4(nan, 0, 0, 1),
                                   glm::vec4(infinite, 0, 0, 1), glm::vec4(1, 0, 0, nan)})
        EXPECT_EQ(becomes(wrong), glm::vec4(0));
}

TEST_F(GltfTangents, OfWhichNoneIsOneAreNotThere) {
    put("TANGENT", std::vector<glm::vec4>(3, glm::vec4(0)), real, "VEC4");
    EXPECT_THAT(read().tangents, IsEmpty());
}

TEST_F(GltfTangents, MayBeBytesOrShorts) {
    doc_["extensionsRequired"] = {"KHR_mesh_quantization"};
    put("TANGENT", std::vector<std::array<int8_t, 4>>{{0, 127, 0, 127}, {0, 127, 0, -127}, {0, -127, 0, 127}},
        signed_byte, "VEC4");
    EXPECT_EQ(read().tangents, turned);
    put("TANGENT",
        std::vector<std::array<int16_t, 4>>{{0, 32767, 0, 32767}, {0, 32767, 0, -32768}, {0, -32768, 0, 32767}},
        signed_short, "VEC4");
    EXPECT_EQ(read().tangents, turned);
}

TEST_F(GltfTangents, MayBeSparse) {
    json& accessor = put("TANGENT", std::vector<glm::vec4>(3, glm::vec4(0, 1, 0, 1)), real, "VEC4");
    const std::vector<uint16_t> places{1, 2};
    const std::vector<glm::vec4> values(turned.begin() + 1, turned.end());
    accessor["sparse"] = {{"count", 2},
                          {"indices", {{"bufferView", view(std::span(places))}, {"componentType", unsigned_short}}},
                          {"values", {{"bufferView", view(std::span(values))}}}};
    EXPECT_EQ(read().tangents, turned);
}

TEST_F(GltfTangents, MayBeDracos) {
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(1);
    const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32),
              tangent = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 4, draco::DT_FLOAT32);
    const std::array<glm::vec3, 3> corners{glm::vec3(0, 0, 0), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0)};
    const draco::FaceIndex face(0);
    builder.SetAttributeValuesForFace(position, face, &corners[0], &corners[1], &corners[2]);
    builder.SetAttributeValuesForFace(tangent, face, &turned[0], &turned[1], &turned[2]);
    const auto built = builder.Finalize();
    draco::Encoder encoder;
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 16);
    draco::EncoderBuffer packed;
    ASSERT_TRUE(encoder.EncodeMeshToBuffer(*built, &packed).ok());

    put("TANGENT", turned, real, "VEC4");
    const std::vector<uint16_t> indices{0, 1, 2};
    put("indices", indices, unsigned_short, "SCALAR").erase("normalized");
    primitive()["indices"] = primitive()["attributes"]["indices"];
    primitive()["attributes"].erase("indices");
    json& attributes = primitive()["attributes"];
    for (const char* key : {"POSITION", "TANGENT"})
        doc_["accessors"][attributes[key].get<size_t>()].erase("bufferView");
    doc_["accessors"][primitive()["indices"].get<size_t>()].erase("bufferView");
    const auto unique = [&](int id) { return built->attribute(id)->unique_id(); };
    primitive()["extensions"]["KHR_draco_mesh_compression"] = {
        {"bufferView", view(std::span(packed.data(), packed.size()))},
        {"attributes", {{"POSITION", unique(position)}, {"TANGENT", unique(tangent)}}}};
    doc_["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    const TriMesh mesh = read();
    ASSERT_EQ(mesh.tangents.size(), 3u);
    for (size_t w = 0; w < 3; ++w) {
        const auto corner = static_cast<size_t>(std::ranges::find(corners, mesh.positions[w]) - corners.begin());
        ASSERT_LT(corner, 3u);
        EXPECT_EQ(mesh.tangents[w], turned[corner]);
    }
}

// By the node's matrix; where that mirrors, the bitangent is mirrored with all else.
TEST_F(GltfTangents, MoveWithTheirNode) {
    put("TANGENT", turned, real, "VEC4");
    const glm::mat4 turn_and_scale(0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1);
    const glm::mat4 mirror(-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
    for (const glm::mat4& place : {turn_and_scale, mirror}) {
        doc_["nodes"][0]["matrix"] = std::vector<float>(&place[0].x, &place[0].x + 16);
        const TriMesh mesh = read();
        ASSERT_EQ(mesh.tangents.size(), 3u);
        for (size_t w = 0; w < 3; ++w) {
            const glm::vec3 tangent(turned[w]), bitangent = glm::cross(glm::vec3(0, 0, 1), tangent) * turned[w].w;
            const glm::vec3 found(mesh.tangents[w]), up = glm::cross(mesh.normals[w], found) * mesh.tangents[w].w;
            EXPECT_GT(glm::dot(found, glm::normalize(glm::mat3(place) * tangent)), 0.99999f);
            EXPECT_GT(glm::dot(up, glm::normalize(glm::mat3(place) * bitangent)), 0.99999f);
        }
    }
}

TEST_F(GltfTangents, AreReadWhereAMapOfNormalsUsesThem) {
    put("TANGENT", turned, real, "VEC4");
    const json whole = doc_;
    primitive()["material"] = 1;
    EXPECT_THAT(read().tangents, IsEmpty()) << "without a map";
    primitive().erase("material");
    EXPECT_THAT(read().tangents, IsEmpty()) << "without a material";
    doc_ = whole;
    primitive()["attributes"].erase("NORMAL");
    EXPECT_THAT(read().tangents, IsEmpty()) << "without normals";
    doc_ = whole;
    doc_["images"][0]["bufferView"] = 1;
    EXPECT_THAT(read().tangents, IsEmpty()) << "with a map that cannot be read";
}

TEST_F(GltfTangents, OfOtherPrimitivesAreNone) {
    put("TANGENT", turned, real, "VEC4");
    json with = primitive(), without = primitive();
    without["material"] = 1;
    doc_["meshes"][0]["primitives"] = {without, with, without};
    const glm::vec4 none(0);
    EXPECT_THAT(read().tangents, ElementsAre(none, none, none, turned[0], turned[1], turned[2], none, none, none));
    without["attributes"].erase("NORMAL");
    doc_["meshes"][0]["primitives"] = {with, without};
    EXPECT_THAT(read().tangents, IsEmpty()) << "nor has the mesh normals then";
}

TEST_F(GltfTangents, OfAnotherNumberOrKindAreRefusedByName) {
    put("TANGENT", turned, real, "VEC4");
    const json whole = doc_;
    const auto said = [&](const char* key, const json& value) {
        doc_ = whole;
        doc_["accessors"].back()[key] = value;
        const auto mesh = tried();
        return mesh ? "nothing" : mesh.error().message;
    };
    EXPECT_THAT(said("count", 2), HasSubstr("mesh 0 primitive 0: has another number of tangents than of positions"));
    EXPECT_THAT(said("type", "VEC3"), HasSubstr("mesh 0 primitive 0 TANGENT: has 3 numbers per element; 4 are needed"));
    EXPECT_THAT(said("count", 300), HasSubstr("TANGENT: reaches past the end of its buffer"));
}

TEST(GltfTangentsOfKhronos, AreReadWithBothSigns) {
    const char* file = "materials/NormalTangentMirrorTest/NormalTangentMirrorTest.glb";
    const auto path = fixtures::real_data(file);
    if (!path) GTEST_SKIP() << fixtures::missing_data_note(file);
    const auto mesh = read_mesh(*path);
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_TRUE(mesh->validate());
    ASSERT_EQ(mesh->tangents.size(), mesh->wedge_count());
    for (const float side : {-1.0f, 1.0f})
        EXPECT_GT(std::ranges::count(mesh->tangents, side, &glm::vec4::w), 50) << side;
    const char* without = "materials/NormalTangentTest/NormalTangentTest.glb";
    const auto plain = fixtures::real_data(without);
    if (!plain) GTEST_SKIP() << fixtures::missing_data_note(without);
    EXPECT_THAT(read_mesh(*plain)->tangents, IsEmpty());
}

}  // namespace
}  // namespace lodestone
