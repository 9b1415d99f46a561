// Files as encoders leave them: Draco, meshoptimizer, WebP; and PLY as photogrammetry writes it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>
#include <tiny_gltf.h>
#include <unistd.h>
#include <webp/encode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "fixtures/gltf_files.h"
#include "fixtures/meshes.h"
#include "fixtures/real_data.h"
#include "mesh/io/compressed/draco.h"
#include "mesh/io/compressed/meshopt.h"
#include "mesh/io/compressed/unpack_gltf.h"
#include "mesh/io/read.h"
#include "mesh/repair.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using fixtures::glb_of;
using nlohmann::json;
using testing::HasSubstr;

class CompressedTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_compressed_" + std::to_string(::getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path put(const std::string& name, const std::string& content) const {
        std::ofstream(folder_ / name, std::ios::binary) << content;
        return folder_ / name;
    }
    fs::path folder_;
};

using Bytes = std::vector<unsigned char>;
std::string text_of(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

Bytes draco_of(const TriMesh& mesh) {
    Bytes packed = fixtures::draco_of(mesh);
    EXPECT_FALSE(packed.empty());
    return packed;
}

DracoPromise promise_of(const TriMesh& mesh) {
    return {{{0, 3, false}}, mesh.vertex_count(), mesh.triangle_count() * 3};
}

json draco_document(const TriMesh& mesh, size_t bytes) {
    json doc = {{"asset", {{"version", "2.0"}}},
                {"extensionsUsed", {"KHR_draco_mesh_compression"}},
                {"extensionsRequired", {"KHR_draco_mesh_compression"}},
                {"buffers", {{{"uri", "mesh.bin"}, {"byteLength", bytes}}}},
                {"bufferViews", {{{"buffer", 0}, {"byteLength", bytes}}}}};
    doc["accessors"] = {{{"componentType", 5126}, {"count", mesh.vertex_count()}, {"type", "VEC3"}},
                        {{"componentType", 5125}, {"count", mesh.triangle_count() * 3}, {"type", "SCALAR"}}};
    const json extension = {{"bufferView", 0}, {"attributes", {{"POSITION", 0}}}};
    doc["meshes"] = {{{"primitives",
                       {{{"attributes", {{"POSITION", 0}}},
                         {"indices", 1},
                         {"extensions", {{"KHR_draco_mesh_compression", extension}}}}}}}};
    return doc;
}

double area_of(const TriMesh& mesh) {
    double area = 0;
    for (size_t t = 0; t < mesh.triangle_count(); ++t)
        area += glm::length(glm::cross(glm::dvec3(mesh.position_of(t, 1) - mesh.position_of(t, 0)),
                                       glm::dvec3(mesh.position_of(t, 2) - mesh.position_of(t, 0)))) /
                2;
    return area;
}

TEST_F(CompressedTest, DracoEqualsThePlainMeshWithinQuantisation) {
    const TriMesh torus = fixtures::torus(20, 12);
    const Bytes packed = draco_of(torus);
    put("mesh.bin", text_of(packed));
    const auto read = read_mesh(put("a.gltf", draco_document(torus, packed.size()).dump()));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->triangle_count(), torus.triangle_count());
    EXPECT_EQ(read->vertex_count(), torus.vertex_count());
    EXPECT_NEAR(area_of(*read), area_of(torus), 1e-3 * area_of(torus));
    for (const glm::vec3& p : read->positions) {
        float nearest = 1e9f;
        for (const glm::vec3& q : torus.positions) nearest = std::min(nearest, glm::distance(p, q));
        EXPECT_LT(nearest, 2.8f / 65535 * 2);
    }
}

TEST_F(CompressedTest, DamagedDracoIsOneLine) {
    const TriMesh torus = fixtures::torus(10, 6);
    const Bytes packed = draco_of(torus);
    for (size_t keep = 0; keep < packed.size(); keep += packed.size() / 7 + 1) {
        Bytes damaged(packed.begin(), packed.begin() + static_cast<ptrdiff_t>(keep));
        put("mesh.bin", text_of(damaged) + std::string(1, 'x'));
        const auto read = read_mesh(put("a.gltf", draco_document(torus, keep + 1).dump()));
        ASSERT_FALSE(read);
        EXPECT_EQ(read.error().fault, Fault::format);
        EXPECT_THAT(read.error().message, HasSubstr("Draco"));
        EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
    }
    for (size_t at = 8; at < packed.size(); at += 13) {
        Bytes damaged = packed;
        damaged[at] ^= 0x5a;
        const auto decoded = decode_draco(damaged, promise_of(torus));  // whatever comes of it
        if (decoded) {
            EXPECT_EQ(decoded->indices.size(), torus.triangle_count() * 3);
        } else {
            EXPECT_EQ(decoded.error().fault, Fault::format);
        }
    }
}

TEST_F(CompressedTest, DracoKeepsToWhatTheAccessorsSay) {
    const TriMesh torus = fixtures::torus(10, 6);
    const Bytes packed = draco_of(torus);
    DracoPromise more = promise_of(torus);
    more.vertices += 1;
    auto decoded = decode_draco(packed, more);
    ASSERT_FALSE(decoded);
    EXPECT_THAT(decoded.error().message, HasSubstr("the accessors say 61"));
    DracoPromise other = promise_of(torus);
    other.attributes[0].id = 7;
    decoded = decode_draco(packed, other);
    ASSERT_FALSE(decoded);
    EXPECT_THAT(decoded.error().message, HasSubstr("no attribute 7"));
}

// Three vertices, whose colours are whole bytes.
Bytes coloured_draco() {
    const std::array<std::array<float, 3>, 3> positions = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    const std::array<std::array<uint8_t, 3>, 3> colours = {{{128, 0, 255}, {0, 10, 20}, {255, 255, 3}}};
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(1);
    const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const int colour = builder.AddAttribute(draco::GeometryAttribute::COLOR, 3, draco::DT_UINT8);
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(0), positions[0].data(), positions[1].data(),
                                      positions[2].data());
    builder.SetAttributeValuesForFace(colour, draco::FaceIndex(0), colours[0].data(), colours[1].data(),
                                      colours[2].data());
    draco::EncoderBuffer buffer;
    EXPECT_TRUE(draco::Encoder().EncodeMeshToBuffer(*builder.Finalize(), &buffer).ok());
    return {buffer.data(), buffer.data() + buffer.size()};
}

// As many primitives of one view, which share their accessors.
json shared_draco_document(size_t bytes, size_t primitives) {
    json doc = {{"asset", {{"version", "2.0"}}},
                {"extensionsUsed", {"KHR_draco_mesh_compression"}},
                {"extensionsRequired", {"KHR_draco_mesh_compression"}},
                {"buffers", {{{"byteLength", bytes}}}},
                {"bufferViews", {{{"buffer", 0}, {"byteLength", bytes}}}}};
    doc["accessors"] = {
        {{"componentType", 5126}, {"count", 3}, {"type", "VEC3"}},
        {{"componentType", 5121}, {"normalized", true}, {"count", 3}, {"type", "VEC3"}},
        {{"componentType", 5125}, {"count", 3}, {"type", "SCALAR"}},
    };
    const json extension = {{"bufferView", 0}, {"attributes", {{"POSITION", 0}, {"COLOR_0", 1}}}};
    const json primitive = {{"attributes", {{"POSITION", 0}, {"COLOR_0", 1}}},
                            {"indices", 2},
                            {"extensions", {{"KHR_draco_mesh_compression", extension}}}};
    doc["meshes"] = {{{"primitives", json::array()}}};
    for (size_t i = 0; i < primitives; ++i) doc["meshes"][0]["primitives"].push_back(primitive);
    return doc;
}

TEST_F(CompressedTest, DracoPrimitivesThatShareAccessorsAreEqual) {
    const Bytes packed = coloured_draco();
    const auto read = read_mesh(put("a.glb", glb_of(shared_draco_document(packed.size(), 3), text_of(packed))));
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->colours.size(), 9u);
    EXPECT_EQ(std::ranges::count(read->colours, glm::u8vec4(188, 0, 255, 255)), 3) << "128 of 255, as sRGB";
    for (size_t i = 3; i < 9; ++i) {
        EXPECT_EQ(read->colours[i], read->colours[i - 3]);
        EXPECT_EQ(read->positions[i], read->positions[i - 3]);
    }
}

TEST_F(CompressedTest, ADracoViewIsDecodedOnceHoweverManyPrimitivesHaveIt) {
    const Bytes packed = coloured_draco();
    const std::string json_text = with_stand_ins(shared_draco_document(packed.size(), 50).dump());
    const std::string glb = glb_of(json::parse(json_text), text_of(packed));
    tinygltf::Model model;
    std::string error, warning;
    ASSERT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromMemory(&model, &error, &warning,
                                                          reinterpret_cast<const unsigned char*>(glb.data()),
                                                          static_cast<unsigned>(glb.size())))
        << error;
    unpack_gltf(model, {0}, {}, [](const std::string& line) { ADD_FAILURE() << line; });
    EXPECT_EQ(model.buffers.size(), 1u + 3) << "indices, positions, colours";
    const auto& primitives = model.meshes[0].primitives;
    for (const auto& primitive : primitives) EXPECT_EQ(primitive.attributes, primitives[0].attributes);
    EXPECT_TRUE(model.accessors[1].normalized) << "the file's own are as they were";
}

TEST_F(CompressedTest, ADracoViewIsNotDecodedInAnyNumberOfWays) {
    const Bytes packed = coloured_draco();
    json doc = shared_draco_document(packed.size(), 17);
    for (size_t i = 0; i < 17; ++i) {
        json accessor = doc["accessors"][1], &primitive = doc["meshes"][0]["primitives"][i];
        const char* const types[] = {"SCALAR", "VEC2", "VEC3"};
        auto& packed_attributes = primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"];
        for (size_t k = 0, left = i; k < 3; ++k, left /= 3) {
            accessor["type"] = types[left % 3];
            primitive["attributes"]["_" + std::to_string(k)] = doc["accessors"].size();
            packed_attributes["_" + std::to_string(k)] = 1;
            doc["accessors"].push_back(accessor);
        }
    }
    const auto read = read_mesh(put("a.glb", glb_of(doc, text_of(packed))));
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr("mesh 0 primitive 16: buffer view 0 is to be decoded in more than 16"));
}

// Positions and indices as meshoptimizer packs them, and what a view says of them.
struct Packed {
    Bytes positions, indices;
};
Packed meshopt_of(const TriMesh& mesh) {
    Packed packed;
    packed.positions.resize(meshopt_encodeVertexBufferBound(mesh.vertex_count(), 12));
    packed.positions.resize(meshopt_encodeVertexBuffer(packed.positions.data(), packed.positions.size(),
                                                       mesh.positions.data(), mesh.vertex_count(), 12));
    std::vector<uint32_t> indices;
    for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    packed.indices.resize(meshopt_encodeIndexBufferBound(indices.size(), mesh.vertex_count()));
    packed.indices.resize(
        meshopt_encodeIndexBuffer(packed.indices.data(), packed.indices.size(), indices.data(), indices.size()));
    return packed;
}

json meshopt_document(const TriMesh& mesh, const Packed& packed) {
    const size_t vertices = mesh.vertex_count(), corners = mesh.triangle_count() * 3, first = packed.positions.size();
    json doc = {{"asset", {{"version", "2.0"}}},
                {"extensionsUsed", {"EXT_meshopt_compression"}},
                {"extensionsRequired", {"EXT_meshopt_compression"}}};
    // The second buffer stands in for what is unpacked, and holds nothing.
    doc["buffers"] = {{{"byteLength", first + packed.indices.size()}},
                      {{"byteLength", vertices * 12 + corners * 4},
                       {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
    const json positions = {
        {"buffer", 0}, {"byteLength", first}, {"byteStride", 12}, {"count", vertices}, {"mode", "ATTRIBUTES"}};
    const json indices = {{"buffer", 0},     {"byteOffset", first}, {"byteLength", packed.indices.size()},
                          {"byteStride", 4}, {"count", corners},    {"mode", "TRIANGLES"}};
    doc["bufferViews"] = {{{"buffer", 1},
                           {"byteLength", vertices * 12},
                           {"byteStride", 12},
                           {"extensions", {{"EXT_meshopt_compression", positions}}}},
                          {{"buffer", 1},
                           {"byteOffset", vertices * 12},
                           {"byteLength", corners * 4},
                           {"extensions", {{"EXT_meshopt_compression", indices}}}}};
    doc["accessors"] = {{{"bufferView", 0}, {"componentType", 5126}, {"count", vertices}, {"type", "VEC3"}},
                        {{"bufferView", 1}, {"componentType", 5125}, {"count", corners}, {"type", "SCALAR"}}};
    doc["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}};
    return doc;
}

TEST_F(CompressedTest, MeshoptEqualsThePlainMesh) {
    const TriMesh torus = fixtures::torus(20, 12);
    const Packed packed = meshopt_of(torus);
    json doc = meshopt_document(torus, packed);
    const std::string binary = text_of(packed.positions) + text_of(packed.indices);
    for (const bool glb : {true, false}) {
        if (!glb) doc["buffers"][0]["uri"] = "mesh.bin";
        put("mesh.bin", binary);
        const auto read = read_mesh(glb ? put("a.glb", glb_of(doc, binary)) : put("a.gltf", doc.dump()));
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_EQ(read->positions, torus.positions);
        ASSERT_EQ(read->triangle_count(), torus.triangle_count());
        for (size_t t = 0; t < torus.triangle_count(); ++t) {
            Triangle a = read->triangles[t], b = torus.triangles[t];
            std::rotate(a.begin(), std::min_element(a.begin(), a.end()), a.end());
            std::rotate(b.begin(), std::min_element(b.begin(), b.end()), b.end());
            EXPECT_EQ(a, b) << "corners may begin anywhere";
        }
    }
}

TEST_F(CompressedTest, FilesThatStandInForMeshoptNeedNotBeThere) {
    const TriMesh torus = fixtures::torus(10, 6);
    const Packed packed = meshopt_of(torus);
    json doc = meshopt_document(torus, packed);
    doc["buffers"][0]["uri"] = "mesh.bin";
    doc["buffers"][1]["uri"] = "fallback.bin";
    put("mesh.bin", text_of(packed.positions) + text_of(packed.indices));
    ReadReport told;
    const auto read = read_mesh(put("a.gltf", doc.dump()), {}, &told);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->positions, torus.positions);
    EXPECT_THAT(told.warnings, testing::IsEmpty());
    EXPECT_FALSE(told.side_files.contains("fallback.bin"));
    // A view that is not compressed needs it.
    doc["bufferViews"].push_back({{"buffer", 1}, {"byteLength", 12}});
    const auto without = read_mesh(put("b.gltf", doc.dump()));
    ASSERT_FALSE(without);
    EXPECT_THAT(without.error().message, HasSubstr("fallback.bin"));
    put("fallback.bin", std::string(torus.vertex_count() * 12 + torus.triangle_count() * 12, 'x'));
    EXPECT_TRUE(read_mesh(folder_ / "b.gltf"));
}

TEST_F(CompressedTest, DamagedMeshoptIsOneLine) {
    const TriMesh torus = fixtures::torus(10, 6);
    Packed packed = meshopt_of(torus);
    const json doc = meshopt_document(torus, packed);
    const auto refused = [&](const json& changed, const std::string& binary) {
        const auto read = read_mesh(put("a.glb", glb_of(changed, binary)));
        EXPECT_FALSE(read);
        return read ? std::string() : read.error().message;
    };
    const std::string binary = text_of(packed.positions) + text_of(packed.indices);
    json changed = doc;
    auto& extension = changed["bufferViews"][0]["extensions"]["EXT_meshopt_compression"];
    extension["count"] = 1e14;
    EXPECT_THAT(refused(changed, binary), HasSubstr("the limit is"));
    extension["count"] = torus.vertex_count() + 20;
    EXPECT_THAT(refused(changed, binary), HasSubstr("buffer view 0: cannot be unpacked"));
    extension["mode"] = "MAGIC";
    EXPECT_THAT(refused(changed, binary), HasSubstr("'MAGIC'"));
    extension["mode"] = "ATTRIBUTES";
    extension["byteStride"] = 6;
    EXPECT_THAT(refused(changed, binary), HasSubstr("stride"));
    extension["byteLength"] = 1e9;
    EXPECT_THAT(refused(changed, binary), HasSubstr("past the end of its buffer"));
    std::string newer = binary;
    newer[0] = static_cast<char>(0xa1);
    EXPECT_THAT(refused(doc, newer), HasSubstr("newer version"));
}

TEST_F(CompressedTest, MeshoptFiltersAreTakenBack) {
    const glm::vec4 normals[4] = {{1, 0, 0, 0}, {0, 0.6f, 0.8f, 0}, {-0.6f, 0, 0.8f, 0}, {0, 0, -1, 0}};
    std::array<int8_t, 16> filtered{};
    meshopt_encodeFilterOct(filtered.data(), 4, 4, 8, &normals[0].x);
    Bytes packed(meshopt_encodeVertexBufferBound(4, 4));
    packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), filtered.data(), 4, 4));
    const auto back = decode_meshopt(packed, {4, 4, "ATTRIBUTES", "OCTAHEDRAL"}, 1000);
    ASSERT_TRUE(back) << back.error().message;
    for (int i = 0; i < 4; ++i) {
        for (int k = 0; k < 3; ++k)
            EXPECT_NEAR(static_cast<int8_t>((*back)[static_cast<size_t>(i * 4 + k)]) / 127.0f, normals[i][k], 0.02);
    }
}

TEST_F(CompressedTest, WebpTexturesAreRead) {
    const TriMesh grid = fixtures::grid(2, 2);
    std::vector<uint8_t> texels;
    for (int i = 0; i < 6 * 4; ++i)
        texels.insert(texels.end(), {static_cast<uint8_t>(i * 10), 7, static_cast<uint8_t>(255 - i), 255});
    uint8_t* webp = nullptr;
    const size_t size = WebPEncodeLosslessRGBA(texels.data(), 6, 4, 24, &webp);
    ASSERT_GT(size, 0u);
    put("a.webp", std::string(reinterpret_cast<char*>(webp), size));
    WebPFree(webp);
    Packed packed = meshopt_of(grid);
    json doc = meshopt_document(grid, packed);
    doc["extensionsUsed"].push_back("EXT_texture_webp");
    doc["extensionsRequired"].push_back("EXT_texture_webp");
    doc["images"] = {{{"uri", "a.webp"}}};
    doc["textures"] = {{{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}};
    doc["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    doc["meshes"][0]["primitives"][0]["material"] = 0;
    const std::string binary = text_of(packed.positions) + text_of(packed.indices);
    ReadReport told;
    auto read = read_mesh(put("a.glb", glb_of(doc, binary)), {}, &told);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->images.size(), 1u) << (told.warnings.empty() ? "" : told.warnings[0]);
    EXPECT_EQ(read->images[0].width, 6u);
    EXPECT_EQ(std::memcmp(read->images[0].texels.data(), texels.data(), texels.size()), 0);
    // Damaged, missing, and of an extension that is not read: plain, and one line.
    const std::string whole = "RIFF\x40" + std::string(3, '\0') + "WEBPVP8L";
    for (const bool there : {true, false}) {
        fs::remove(folder_ / "a.webp");
        if (there) put("a.webp", whole);
        told = {};
        read = read_mesh(folder_ / "a.glb", {}, &told);
        ASSERT_TRUE(read);
        EXPECT_TRUE(read->images.empty());
        ASSERT_EQ(told.warnings.size(), 1u);
        EXPECT_THAT(told.warnings[0], HasSubstr("keeps its plain colour"));
    }
    doc["textures"] = {{{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}}};
    told = {};
    ASSERT_TRUE(read_mesh(put("a.glb", glb_of(doc, binary)), {}, &told));
    ASSERT_EQ(told.warnings.size(), 1u);
    EXPECT_THAT(told.warnings[0], HasSubstr("KHR_texture_basisu"));
}

TEST_F(CompressedTest, KhronosVariantsOfOneMeshAreEqual) {
    const auto draco = fixtures::real_data("materials/Avocado/Avocado.gltf"),
               quantised = fixtures::real_data("materials/Avocado/AvocadoQuantized.gltf");
    if (!draco || !quantised) GTEST_SKIP() << fixtures::missing_data_note("materials/Avocado");
    auto a = read_mesh(*draco), b = read_mesh(*quantised);
    ASSERT_TRUE(a) << a.error().message;
    ASSERT_TRUE(b) << b.error().message;
    EXPECT_EQ(a->triangle_count(), b->triangle_count());
    EXPECT_NEAR(area_of(*a), area_of(*b), 2e-3 * area_of(*b));
    EXPECT_EQ(a->images.size(), b->images.size());
    EXPECT_EQ(a->uvs.empty(), b->uvs.empty());
    const Box of_a = bounding_box(a->positions), of_b = bounding_box(b->positions);
    EXPECT_LT(glm::distance(of_a.low, of_b.low) + glm::distance(of_a.high, of_b.high), 2e-3f * of_b.diagonal());
}

TEST_F(CompressedTest, KtxTexturesLeaveThePlainColour) {
    const auto path = fixtures::real_data("materials/AnisotropyBarnLamp/AnisotropyBarnLamp.gltf");
    if (!path) GTEST_SKIP() << fixtures::missing_data_note("materials/AnisotropyBarnLamp");
    ReadReport told;
    const auto read = read_mesh(*path, {}, &told);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(read->images.empty());
    EXPECT_THAT(told.warnings, testing::Contains(HasSubstr("KHR_texture_basisu")));
}

// Two triangles on four vertices, each with texture coordinates and a texture of its own.
std::string photogrammetry(const std::string& format) {
    return "ply\nformat " + format +
           " 1.0\ncomment TextureFile one.png\ncomment TextureFile the other.png\n"
           "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
           "property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n"
           "end_header\n";
}

void check_photogrammetry(const Result<TriMesh>& read) {
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_TRUE(read->validate());
    EXPECT_EQ(read->vertex_count(), 4u);
    EXPECT_EQ(read->wedge_count(), 6u) << "a seam along the diagonal";
    ASSERT_EQ(read->material_table.size(), 2u);
    EXPECT_EQ(read->material_table[1].name, "the other.png");
    for (int t = 0; t < 2; ++t) EXPECT_EQ(read->materials[read->triangles[static_cast<size_t>(t)][0]], t);
    EXPECT_EQ(read->uvs[read->triangles[0][1]], glm::vec2(0.5f, 1));
    EXPECT_EQ(read->uvs[read->triangles[1][2]], glm::vec2(0.25f, 0.25f));
}

TEST_F(CompressedTest, PlyKeepsTextureCoordinatesOfFaces) {
    const auto ascii = put("a.ply", photogrammetry("ascii") +
                                        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
                                        "3 0 1 2 6 0 0 0.5 0 0.5 0.5 0\n"
                                        "3 0 2 3 6 0 0.25 0.75 0.25 0.25 0.75 1\n");
    ReadReport told;
    check_photogrammetry(read_mesh(ascii, {}, &told));
    EXPECT_EQ(told.side_files.size(), 2u) << "textures are looked for";
    std::string body;
    const auto add = [&](auto value) { body.append(reinterpret_cast<const char*>(&value), sizeof value); };
    for (const glm::vec3& p : {glm::vec3(0), glm::vec3(1, 0, 0), glm::vec3(1, 1, 0), glm::vec3(0, 1, 0)}) add(p);
    const std::vector<std::pair<std::array<int32_t, 3>, std::array<float, 6>>> faces = {
        {{0, 1, 2}, {0, 0, 0.5f, 0, 0.5f, 0.5f}}, {{0, 2, 3}, {0, 0.25f, 0.75f, 0.25f, 0.25f, 0.75f}}};
    for (int32_t f = 0; f < 2; ++f) {
        add(uint8_t{3});
        add(faces[static_cast<size_t>(f)].first);
        add(uint8_t{6});
        add(faces[static_cast<size_t>(f)].second);
        add(f);
    }
    const auto binary = put("b.ply", photogrammetry("binary_little_endian") + body);
    check_photogrammetry(read_mesh(binary));
    auto stream = open_mesh_stream(binary);
    ASSERT_TRUE(stream);
    const auto collected = collect(**stream);
    ASSERT_TRUE(collected);
    EXPECT_EQ(collected->uvs.size(), 6u);
    EXPECT_FALSE(read_mesh(put("cut.ply", (photogrammetry("binary_little_endian") + body).substr(0, 420))));
}

// Elements of one file may differ: faces with texture coordinates, faces of three indices and nothing else, strips.
TEST_F(CompressedTest, PlyFacesWithoutTextureCoordinatesTakeThoseOfTheirVertices) {
    for (const bool vertices_have : {false, true}) {
        for (const bool faces_first : {false, true}) {
            SCOPED_TRACE(testing::Message() << vertices_have << faces_first);
            std::string header = "ply\nformat binary_little_endian 1.0\n", body;
            const auto add = [&](auto value) { body.append(reinterpret_cast<const char*>(&value), sizeof value); };
            const auto add_vertices = [&] {
                header += "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
                if (vertices_have) header += "property float s\nproperty float t\n";
                for (const glm::vec3& p : {glm::vec3(0), glm::vec3(1, 0, 0), glm::vec3(1, 1, 0), glm::vec3(0, 1, 0)}) {
                    add(p);
                    if (vertices_have) add(glm::vec2(0.125f, 0.25f));
                }
            };
            if (!faces_first) add_vertices();
            header +=
                "element face 2\nproperty list uchar int vertex_indices\nelement face 1\nproperty list uchar int "
                "vertex_indices\nproperty list uchar float texcoord\nelement tristrips 1\nproperty list int int "
                "vertex_indices\n";
            for (const auto& face : {std::array{0, 1, 2}, {0, 2, 3}}) {
                add(uint8_t{3});
                add(face);
            }
            add(uint8_t{3});
            add(std::array{1, 2, 3});
            add(uint8_t{6});
            add(std::array{0.5f, 0.75f, 0.5f, 0.75f, 0.5f, 0.75f});
            add(4);
            add(std::array{0, 1, 2, 3});
            if (faces_first) add_vertices();
            const auto read = read_mesh(put("a.ply", header + "end_header\n" + body));
            ASSERT_TRUE(read) << read.error().message;
            ASSERT_EQ(read->triangle_count(), 5u);
            const glm::vec2 of_vertices = vertices_have ? glm::vec2(0.125f, 0.75f) : glm::vec2(0);
            for (size_t t = 0; t < 5; ++t) {
                for (const uint32_t w : read->triangles[t])
                    EXPECT_EQ(read->uvs[w], t == 2 ? glm::vec2(0.5f, 0.25f) : of_vertices) << t;
            }
        }
    }
}

TEST_F(CompressedTest, PlyFacesWithoutATextureKeepTheMaterialOfTheirVertices) {
    const auto read = read_mesh(
        put("a.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty "
            "int material_index\nelement face 1\nproperty list uchar int vertex_indices\nproperty list uchar float "
            "texcoord\nend_header\n0 0 0 2\n1 0 0 2\n0 1 0 2\n3 0 1 2 6 0 0 1 0 0 1\n"));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->materials, std::vector<uint16_t>(3, 2));
    EXPECT_EQ(read->material_table.size(), 3u);
}

}  // namespace
}  // namespace lodestone
