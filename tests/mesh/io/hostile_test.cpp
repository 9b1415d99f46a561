// Files that ask for too much, lie, or name what is not theirs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <webp/encode.h>
#include <zlib.h>

#include <cstdio>
// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "base/files/file.h"
#include "fixtures/meshes.h"
#include "mesh/generate.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class HostileTest : public testing::Test {
protected:
    void SetUp() override {
        root_ = fs::temp_directory_path() / ("lodestone_hostile_" + std::to_string(::getpid()));
        folder_ = root_ / "mesh";
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(root_); }

    fs::path put(const std::string& name, const std::string& content) {
        std::ofstream(folder_ / name, std::ios::binary) << content;
        return folder_ / name;
    }
    static std::string refusal(const Result<TriMesh>& mesh) {
        EXPECT_FALSE(mesh) << "was read";
        if (mesh) return "";
        EXPECT_EQ(mesh.error().fault, Fault::format);
        EXPECT_EQ(mesh.error().message.find('\n'), std::string::npos);
        return mesh.error().message;
    }
    std::string refused(const std::string& name, const std::string& content, const ReadOptions& options = {}) {
        return refusal(read_mesh(put(name, content), options));
    }
    fs::path put_image(const std::string& name, uint8_t grey) {
        Image image{2, 2, std::vector<glm::u8vec4>(4, {grey, grey, grey, 255})};
        EXPECT_TRUE(write_png(image, folder_ / name));
        return folder_ / name;
    }
    fs::path root_, folder_;
};

std::string binary_stl(const TriMesh& mesh) {
    std::string stl(80, ' ');
    const auto append = [&](const auto& value) { stl.append(reinterpret_cast<const char*>(&value), sizeof value); };
    append(static_cast<uint32_t>(mesh.triangle_count()));
    for (const Triangle& triangle : mesh.triangles) {
        append(glm::vec3(0));
        for (const uint32_t w : triangle) append(mesh.positions[mesh.wedge_vertex[w]]);
        append(uint16_t{0});
    }
    return stl;
}

// A document with one buffer: a triangle, its texture coordinates, and whatever else is said of it.
struct Document {
    std::string uvs = "\"TEXCOORD_0\":1", material = "{}", nodes = "[{\"mesh\":0}]", roots = "[0]", head, accessors;
    std::string json() const {
        // 3 positions, 3 pairs (0 0, 1 0, 0 1), as base64.
        return "{\"asset\":{\"version\":\"2.0\"}," + head +
               "\"buffers\":[{\"byteLength\":60,\"uri\":\"data:application/octet-stream;base64,"
               "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/\"}],"
               "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\"byteLength\":24}],"
               "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
               "{\"bufferView\":1,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}" +
               accessors + "],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0," + uvs +
               "},\"material\":0}]}],\"materials\":[" + material + "],\"nodes\":" + nodes +
               ",\"scenes\":[{\"nodes\":" + roots + "}]}";
    }
};

TEST_F(HostileTest, GltfSparseAccessorsAskForNoMoreThanTheFileHolds) {
    Document document;
    document.accessors =
        ",{\"componentType\":5126,\"count\":4294967280,\"type\":\"VEC3\",\"sparse\":{\"count\":1,\"indices\":{"
        "\"bufferView\":0,\"componentType\":5121},\"values\":{\"bufferView\":0}}}";
    std::string json = document.json();
    json.replace(json.find("\"POSITION\":0"), 12, "\"POSITION\":2");
    EXPECT_THAT(refused("a.gltf", json), HasSubstr("the limit is"));
    // Even with room for as many vertices.
    json.replace(json.find("4294967280"), 10, "400000000");
    EXPECT_THAT(refused("b.gltf", json), HasSubstr("asks for 400000000 elements that are not stored; the limit is"));
    // As many as there are bytes may be meant.
    json.replace(json.find("400000000"), 9, "3");
    json.replace(json.find("\"count\":1,"), 10, "\"count\":0,");
    const auto flat = read_mesh(put("c.gltf", json));
    ASSERT_TRUE(flat) << flat.error().message;
    EXPECT_EQ(flat->positions, std::vector<glm::vec3>(3, glm::vec3(0)));
}

TEST_F(HostileTest, GltfNodesWithTwoParentsAreNotVisitedTwice) {
    // Every node has the next one twice: 2^200 ways lead to the last.
    Document document;
    document.nodes = "[";
    for (int i = 0; i < 200; ++i) {
        const std::string next = std::to_string(i + 1);
        document.nodes += "{\"children\":[" + next + "," + next + "]},";
    }
    document.nodes += "{\"mesh\":0}]";
    EXPECT_THAT(refused("a.gltf", document.json()), HasSubstr("two parents"));
    EXPECT_FALSE(read_gltf_nodes(folder_ / "a.gltf"));
    document.nodes = "[{\"children\":[1]},{\"mesh\":0},{\"children\":[1]}]";
    document.roots = "[0,2]";
    EXPECT_THAT(refused("b.gltf", document.json()), HasSubstr("node 1 has two parents"));
    document.nodes = "[{\"mesh\":0},{\"mesh\":0}]";
    document.roots = "[0,1]";
    const auto twice = read_mesh(put("c.gltf", document.json()));
    ASSERT_TRUE(twice);
    EXPECT_EQ(twice->triangle_count(), 2u) << "a mesh may stand in many places";
}

TEST_F(HostileTest, GltfNestedTooDeepIsRefusedWithoutGoingThere) {
    Document document;
    document.head = "\"extras\":" + std::string(200000, '[') + std::string(200000, ']') + ",";
    EXPECT_THAT(refused("a.gltf", document.json()), HasSubstr("512 deep"));
    document.head = "\"extras\":\"" + std::string(2000, '[') + "\\\"{\",";
    EXPECT_TRUE(read_mesh(put("b.gltf", document.json()))) << "in words they mean nothing";
}

TEST_F(HostileTest, GltfExtensionsThatChangeShapesAreRefusedByNameOthersAreNoted) {
    Document document;
    document.head = "\"extensionsUsed\":[\"ACME_bent_meshes\"],\"extensionsRequired\":[\"ACME_bent_meshes\"],";
    EXPECT_THAT(refused("a.gltf", document.json()), HasSubstr("ACME_bent_meshes"));
    for (const char* name : {"KHR_texture_basisu", "KHR_lights_punctual"}) {
        document.head = R"("extensionsUsed":[")" + std::string(name) + R"("],"extensionsRequired":[")" + name + "\"],";
        ReadReport report;
        ASSERT_TRUE(read_mesh(put("b.gltf", document.json()), {}, &report));
        EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("requires the extension " + std::string(name))));
    }
    for (const char* name : {"EXT_mesh_gpu_instancing", "KHR_materials_specular", "KHR_lights_punctual",
                             "KHR_xmp_json_ld", "ACME_bent_meshes"}) {
        document.head = R"("extensionsUsed":[")" + std::string(name) + "\"],";
        ReadReport report;
        ASSERT_TRUE(read_mesh(put("c.gltf", document.json()), {}, &report));
        EXPECT_THAT(report.warnings,
                    ElementsAre(HasSubstr("uses the extension " + std::string(name) + ", which is left out")));
    }
    document.head = R"("extensionsUsed":["KHR_mesh_quantization","KHR_texture_transform"],)";
    ReadReport report;
    ASSERT_TRUE(read_mesh(put("d.gltf", document.json()), {}, &report));
    EXPECT_THAT(report.warnings, IsEmpty()) << "these are read";
}

TEST_F(HostileTest, GltfTextureCoordinatesAreMovedAsTheMaterialSays) {
    Document document;
    document.head =
        "\"extensionsUsed\":[\"KHR_texture_transform\"],\"extensionsRequired\":[\"KHR_texture_transform\"],";
    document.material =
        "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"texCoord\":0,\"extensions\":{"
        "\"KHR_texture_transform\":{\"offset\":[0.25,0.5],\"rotation\":1.5707963267948966,\"scale\":[2,3],"
        "\"texCoord\":1}}}}}";
    document.uvs = "\"TEXCOORD_1\":1";
    const auto mesh = read_mesh(put("a.gltf", document.json()));
    ASSERT_TRUE(mesh) << mesh.error().message;
    // (1, 0) is scaled to (2, 0), turned to (0, -2), and moved.
    ASSERT_EQ(mesh->uvs.size(), 3u);
    const glm::vec2 expected[] = {{0.25f, 0.5f}, {0.25f, -1.5f}, {3.25f, 0.5f}};
    for (size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(mesh->uvs[i].x, expected[i].x, 1e-6f) << i;
        EXPECT_NEAR(mesh->uvs[i].y, expected[i].y, 1e-6f) << i;
    }
    document.uvs = "\"TEXCOORD_0\":1";
    ReadReport report;
    ASSERT_TRUE(read_mesh(put("b.gltf", document.json()), {}, &report));
    EXPECT_THAT(report.warnings, Contains(HasSubstr("no TEXCOORD_1")));
}

TEST_F(HostileTest, WhatIsOverALimitIsRefusedByOneLineThatNamesBoth) {
    const TriMesh cube = fixtures::cube_with_seams();
    std::map<std::string, fs::path> files;
    for (const char* name : {"cube.ply", "cube.obj", "cube.glb"}) {
        ASSERT_TRUE(write_mesh(cube, folder_ / name)) << name;
        files[name] = folder_ / name;
    }
    files["cube.stl"] = put("cube.stl", binary_stl(cube));
    files["cube.off"] = put("cube.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n");
    files["quad.off"] = put("quad.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    files["text.stl"] =
        put("text.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
            "0\nendloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
            "1\nendloop\nendfacet\nendsolid\n");
    for (const auto& [name, path] : files) {
        SCOPED_TRACE(name);
        ReadOptions options;
        const auto whole = read_mesh(path, options);
        ASSERT_TRUE(whole) << whole.error().message;
        options.limits.vertices = whole->wedge_count();
        options.limits.triangles = whole->triangle_count();
        EXPECT_TRUE(read_mesh(path, options)) << "as many as allowed";
        --options.limits.vertices;
        EXPECT_THAT(refusal(read_mesh(path, options)),
                    AllOf(HasSubstr("; the limit is " + std::to_string(options.limits.vertices)), HasSubstr("has ")));
        ++options.limits.vertices;
        --options.limits.triangles;
        EXPECT_THAT(refusal(read_mesh(path, options)),
                    HasSubstr("; the limit is " + std::to_string(options.limits.triangles)));
    }
}

TEST_F(HostileTest, LimitsHoldForStreams) {
    const TriMesh rock = generate(Shape::rock, 3000, 1);
    ASSERT_TRUE(write_mesh(rock, folder_ / "rock.ply"));
    put("rock.stl", binary_stl(rock));
    for (const char* name : {"rock.ply", "rock.stl"}) {
        SCOPED_TRACE(name);
        ReadOptions options;
        options.limits.triangles = rock.triangle_count() - 1;
        auto stream = open_mesh_stream(folder_ / name, options);
        if (stream) {
            const auto mesh = collect(**stream);
            ASSERT_FALSE(mesh);
            EXPECT_THAT(mesh.error().message, HasSubstr("the limit is"));
        } else {
            EXPECT_THAT(stream.error().message, HasSubstr("the limit is"));
        }
    }
}

TEST_F(HostileTest, ImagesThatPromiseMoreThanTheyHoldTakeNoRoom) {
    put_image("small.png", 7);
    std::ifstream in(folder_ / "small.png", std::ios::binary);
    std::string png{std::istreambuf_iterator<char>(in), {}};
    png.replace(16, 8, std::string("\0\0\x40\0\0\0\x40\0", 8));  // 16384 x 16384
    const uint32_t checksum = crc32(0, reinterpret_cast<const Bytef*>(png.data()) + 12, 17);
    for (int k = 0; k < 4; ++k) png[29 + k] = static_cast<char>(checksum >> (24 - 8 * k));
    const auto whole = decode_image(std::as_bytes(std::span(png)), "large.png");
    ASSERT_FALSE(whole);
    EXPECT_THAT(whole.error().message, HasSubstr("cut"));
    const auto limited = decode_image(std::as_bytes(std::span(png)), "large.png", 100);
    ASSERT_FALSE(limited);
    EXPECT_THAT(limited.error().message, HasSubstr("16384x16384 texels; the limit is 1 to 100 a side"));
    EXPECT_FALSE(png_may_be_whole(std::as_bytes(std::span(png))));
}

std::string text_of(const std::vector<std::byte>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

Image noise(uint32_t side) {
    Image image{side, side, {}};
    uint32_t random = 1;
    for (uint32_t i = 0; i < side * side; ++i) {
        random = random * 1664525 + 1013904223;
        image.texels.emplace_back(random >> 24, random >> 16 & 255, random >> 8 & 255, 255);
    }
    return image;
}

// Of one grey, as small as an encoder makes it.
std::string flat_jpeg(uint32_t side, bool progressive) {
    jpeg_compress_struct info{};
    jpeg_error_mgr error{};
    info.err = jpeg_std_error(&error);
    jpeg_create_compress(&info);
    unsigned char* packed = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&info, &packed, &size);
    info.image_width = info.image_height = side;
    info.input_components = 3;
    info.in_color_space = JCS_RGB;
    jpeg_set_defaults(&info);
    info.optimize_coding = TRUE;
    if (progressive) jpeg_simple_progression(&info);
    jpeg_start_compress(&info, TRUE);
    std::vector<unsigned char> row(size_t{side} * 3, 90);
    JSAMPROW pointer = row.data();
    while (info.next_scanline < side) jpeg_write_scanlines(&info, &pointer, 1);
    jpeg_finish_compress(&info);
    jpeg_destroy_compress(&info);
    std::string jpeg(reinterpret_cast<const char*>(packed), size);
    std::free(packed);
    return jpeg;
}

TEST_F(HostileTest, JpegsThatPromiseMoreThanTheyHoldTakeNoRoom) {
    for (const bool progressive : {false, true}) {
        SCOPED_TRACE(progressive);
        const std::string flat = flat_jpeg(2048, progressive);
        const auto image = decode_image(bytes_of(flat), "flat.jpg");
        ASSERT_TRUE(image) << "what is as small as it can be is read: " << image.error().message;
        EXPECT_EQ(image->width, 2048u);
        std::string lie = flat_jpeg(16, progressive);
        const size_t frame = lie.find(progressive ? "\xff\xc2" : "\xff\xc0");
        ASSERT_NE(frame, lie.npos);
        lie.replace(frame + 5, 4, std::string("\x40\0\x40\0", 4));  // 16384 x 16384
        const auto large = decode_image(bytes_of(lie), "large.jpg");
        ASSERT_FALSE(large);
        EXPECT_THAT(large.error().message, AllOf(HasSubstr("large.jpg: JPEG: promises 16384x16384 texels"),
                                                 HasSubstr("the file is cut or damaged")));
    }
}

TEST_F(HostileTest, JpegsOfScansWithoutEndAreRefused) {
    std::string jpeg = flat_jpeg(64, true);
    const size_t last = jpeg.rfind("\xff\xda"), end = jpeg.rfind("\xff\xd9");
    ASSERT_TRUE(last != jpeg.npos && end != jpeg.npos && last < end);
    const std::string scan = jpeg.substr(last, end - last);
    for (int k = 0; k < 200; ++k) jpeg.insert(last, scan);
    const auto image = decode_image(bytes_of(jpeg), "a.jpg");
    ASSERT_FALSE(image);
    EXPECT_THAT(image.error().message, HasSubstr("has more than 100 scans"));
}

TEST_F(HostileTest, WebpsThatPromiseMoreThanTheyHoldTakeNoRoom) {
    const std::vector<uint8_t> texels(size_t{1024} * 1024 * 3, 90);
    const auto packed = [&](int side) {
        uint8_t* bytes = nullptr;
        const size_t size = WebPEncodeRGB(texels.data(), side, side, side * 3, 1, &bytes);
        std::string webp(reinterpret_cast<const char*>(bytes), size);
        WebPFree(bytes);
        return webp;
    };
    EXPECT_TRUE(decode_image(bytes_of(packed(1024)), "flat.webp"));
    std::string lie = packed(16);
    const size_t start = lie.find("\x9d\x01\x2a");  // of a frame, before its width and height
    ASSERT_NE(start, lie.npos);
    lie.replace(start + 3, 4, "\xff\x3f\xff\x3f");  // 16383 x 16383
    const auto large = decode_image(bytes_of(lie), "large.webp");
    ASSERT_FALSE(large);
    EXPECT_THAT(large.error().message, HasSubstr("large.webp: WebP: promises more than its bytes can hold"));
}

TEST_F(HostileTest, ACutJpegIsKeptAndToldOfByName) {
    const auto jpeg = encode_jpeg(noise(64), 80);
    ASSERT_TRUE(jpeg);
    const std::string whole = text_of(*jpeg), cut = whole.substr(0, whole.size() / 2);
    put("a.mtl", "newmtl m\nmap_Kd a.jpg\n");
    const auto obj = put("a.obj", "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
    Document document;
    document.material = "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}";
    document.head = "\"images\":[{\"uri\":\"a.jpg\"}],\"textures\":[{\"source\":0}],";
    for (const fs::path& path : {obj, put("a.gltf", document.json())}) {
        SCOPED_TRACE(path.extension());
        put("a.jpg", whole);
        ReadReport report;
        ASSERT_TRUE(read_mesh(path, {}, &report));
        EXPECT_THAT(report.warnings, IsEmpty());
        put("a.jpg", cut);
        report = {};
        const auto read = read_mesh(path, {}, &report);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_THAT(report.warnings, ElementsAre(AllOf(HasSubstr("texture 'a.jpg' is damaged (JPEG: "),
                                                       HasSubstr("what it lacks is grey"))));
        ASSERT_EQ(read->images.size(), 1u);
        EXPECT_EQ(read->images[0].height, 64u);
    }
}

TEST_F(HostileTest, ImagesOfNoOrOfTooManyTexelsLeaveThePlainColour) {
    put_image("a.png", 7);
    std::ifstream in(folder_ / "a.png", std::ios::binary);
    std::string png{std::istreambuf_iterator<char>(in), {}};
    put("a.mtl", "newmtl m\nKd 1 0.5 0\nmap_Kd a.png\n");
    const auto obj = put("a.obj", "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
    for (const auto& [size, what] : {std::pair{std::string(8, '\0'), "PNG: "},
                                     {std::string("\0\1\0\0\0\1\0\0", 8), "is 65536x65536 texels; the limit is"}}) {
        png.replace(16, 8, size);
        const uint32_t checksum = crc32(0, reinterpret_cast<const Bytef*>(png.data()) + 12, 17);
        for (int k = 0; k < 4; ++k) png[29 + k] = static_cast<char>(checksum >> (24 - 8 * k));
        put("a.png", png);
        ReadReport report;
        const auto read = read_mesh(obj, {}, &report);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_THAT(report.warnings, ElementsAre(AllOf(HasSubstr("texture 'a.png' cannot be read"), HasSubstr(what),
                                                       HasSubstr("its material keeps its plain colour"))));
        EXPECT_TRUE(read->images.empty());
        EXPECT_EQ(read->material_table[0].base_colour, glm::vec4(1, 0.5f, 0, 1));
    }
}

TEST_F(HostileTest, LibrariesAndTexturesOutsideTheFolderAreLeftOutUnlessAllowed) {
    std::ofstream(root_ / "far.mtl") << "newmtl red\nKd 1 0 0\n";
    fs::create_symlink(root_ / "far.mtl", folder_ / "link.mtl");
    const std::string faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    for (const std::string& library :
         {std::string("../far.mtl"), (root_ / "far.mtl").string(), std::string("link.mtl")}) {
        SCOPED_TRACE(library);
        const fs::path path = put("a.obj", "mtllib " + library + "\n" + faces);
        ReadReport report;
        const auto without = read_mesh(path, {}, &report);
        ASSERT_TRUE(without);
        EXPECT_EQ(without->material_table.at(0).base_colour, glm::vec4(1));
        EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("--allow-outside")));
        ReadOptions options;
        options.allow_outside = true;
        report = {};
        const auto with = read_mesh(path, options, &report);
        ASSERT_TRUE(with);
        EXPECT_EQ(with->material_table.at(0).base_colour, glm::vec4(1, 0, 0, 1));
        EXPECT_THAT(report.warnings, IsEmpty());
    }
    fs::rename(put_image("t.png", 9), root_ / "t.png");
    put("near.mtl", "newmtl red\nmap_Kd ..\\t.png\n");
    const fs::path path = put("b.obj", "mtllib near.mtl\n" + faces);
    ReadReport report;
    ASSERT_TRUE(read_mesh(path, {}, &report));
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("--allow-outside")));
}

TEST_F(HostileTest, GltfBuffersOutsideTheFolderAreRefusedUnlessAllowed) {
    std::ofstream(root_ / "far.bin", std::ios::binary) << std::string(60, '\0');
    std::string json = Document().json();
    const size_t uri = json.find("data:application");
    json.replace(uri, json.find('"', uri) - uri, "../far.bin");
    EXPECT_THAT(refused("a.gltf", json), HasSubstr("--allow-outside"));
    ReadOptions options;
    options.allow_outside = true;
    EXPECT_TRUE(read_mesh(folder_ / "a.gltf", options));
    json.replace(json.find("../far"), 6, "%2e%2e/far");
    EXPECT_THAT(refused("b.gltf", json), HasSubstr("--allow-outside")) << "however it is written";
    // Nothing is looked for where the program happens to run.
    json.replace(json.find("%2e%2e/far"), 10, "far");
    const fs::path before = fs::current_path();
    fs::current_path(root_);
    EXPECT_THAT(refused("c.gltf", json), HasSubstr("cannot be opened"));
    fs::current_path(before);
}

// A backslash joins a line to the next, after the name of a material, too; in a comment it joins nothing.
TEST_F(HostileTest, LinesAreTheSameToTheMeshAndToItsHash) {
    put("m.mtl", "newmtl red\nKd 1 0 0\n");
    const auto is_red = [&](const std::string& lines) {
        const fs::path path = put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0 " + lines + "\nusemtl red\nf 1 2 3\n");
        ReadOptions options;
        options.hash_source = true;
        ReadReport report;
        const auto mesh = read_mesh(path, options, &report);
        const auto hash = hash_of_source(path);
        EXPECT_TRUE(mesh && hash) << lines;
        if (!mesh || !hash) return false;
        EXPECT_EQ(hash->hex(), report.source.hex()) << lines;
        return std::ranges::any_of(mesh->material_table, [](const Material& m) { return m.base_colour.y == 0; });
    };
    EXPECT_FALSE(is_red("\nusemtl red \\\nmtllib m.mtl"));
    EXPECT_FALSE(is_red("\nusemtl a # \\\nmtllib m.mtl"));
    EXPECT_TRUE(is_red("\nusemtl # \\\nmtllib m.mtl"));
    EXPECT_TRUE(is_red("# \\\nmtllib m.mtl"));
    EXPECT_TRUE(is_red("\n# \\\nmtllib m.mtl"));
    EXPECT_TRUE(is_red("\nvn 0 0 1 # C:\\dir\\\nmtllib m.mtl"));
    EXPECT_TRUE(is_red("\ng part # \\\nmtllib m.mtl"));
}

TEST_F(HostileTest, TheHashOfASourceCoversWhatItRefersTo) {
    put_image("t.png", 1);
    put("m.mtl", "newmtl red\nKd 1 0 0\nmap_Kd t.png\n");
    const fs::path obj = put("a.obj", "# m\nmtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n");
    std::string json = Document().json();
    const size_t uri = json.find("data:application");
    json.replace(uri, json.find('"', uri) - uri, "a.bin");
    put("a.bin", std::string(60, '\0'));
    json.insert(json.find("\"nodes\""), "\"images\":[{\"uri\":\"t.png\"}],\"textures\":[{\"source\":0}],");
    const fs::path gltf = put("a.gltf", json);
    const fs::path ply = folder_ / "a.ply";
    ASSERT_TRUE(write_mesh(fixtures::cube_with_seams(), ply));

    ReadOptions options;
    options.hash_source = true;
    // Told without reading the mesh, and the same as when it is read.
    const auto hash_of_file = [&](const fs::path& path) {
        const auto hash = hash_of_source(path);
        EXPECT_TRUE(hash) << hash.error().message;
        ReadReport report;
        EXPECT_TRUE(read_mesh(path, options, &report));
        EXPECT_EQ(hash->hex(), report.source.hex()) << path;
        return hash->hex();
    };
    std::set<std::string> objs{hash_of_file(obj)}, gltfs{hash_of_file(gltf)};
    put("m.mtl", "newmtl red\nKd 1 1 0\nmap_Kd t.png\n");
    EXPECT_TRUE(objs.insert(hash_of_file(obj)).second) << "another colour";
    put_image("t.png", 2);
    EXPECT_TRUE(objs.insert(hash_of_file(obj)).second) << "another texture";
    EXPECT_TRUE(gltfs.insert(hash_of_file(gltf)).second) << "another texture";
    put("a.bin", std::string(36, '\0') + std::string(24, '\1'));
    EXPECT_TRUE(gltfs.insert(hash_of_file(gltf)).second) << "another buffer";
    fs::remove(folder_ / "t.png");
    EXPECT_TRUE(objs.insert(hash_of_file(obj)).second) << "no texture";
    EXPECT_TRUE(gltfs.insert(hash_of_file(gltf)).second) << "no texture";
    fs::remove(folder_ / "m.mtl");
    EXPECT_TRUE(objs.insert(hash_of_file(obj)).second) << "no library";
    const auto content = read_file(ply);
    EXPECT_EQ(hash_of_file(ply), hash_bytes(content->bytes).hex()) << "a file by itself";
}

TEST_F(HostileTest, AMeshThatIsCutWhileItIsReadIsRefused) {
    const fs::path path = folder_ / "rock.ply";
    ASSERT_TRUE(write_mesh(generate(Shape::rock, 100000, 1), path));
    auto stream = open_mesh_stream(path);
    ASSERT_TRUE(stream);
    MeshBatch batch;
    ASSERT_TRUE((*stream)->next(batch, 1000));
    fs::resize_file(path, 8192);
    const auto rest = collect(**stream);
    ASSERT_FALSE(rest);
    EXPECT_THAT(rest.error().message, HasSubstr("while it was read"));
}

TEST_F(HostileTest, NamesThatAreNoUtf8ReachNoReport) {
    ReadReport report;
    ASSERT_TRUE(read_mesh(put("a.obj", "mtllib b\xe9ton.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), {}, &report));
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("béton.mtl")));
}

TEST_F(HostileTest, WhatAMeshNamesIsBoundedInNumberAndSize) {
    const std::string faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    std::string libraries;
    for (int i = 0; i < 50; ++i) libraries += "mtllib " + std::to_string(i) + ".mtl\n";
    ReadOptions options;
    options.limits.side_files = 5;
    options.limits.warnings = 7;
    ReadReport report;
    ASSERT_TRUE(read_mesh(put("a.obj", libraries + faces), options, &report));
    EXPECT_EQ(report.side_files.size(), 5u);
    ASSERT_EQ(report.warnings.size(), 8u);
    EXPECT_THAT(report.warnings[5], HasSubstr("names; the limit is 5"));
    EXPECT_EQ(report.warnings[7], "there is more to warn of");
    // One image by many names is many images.
    put_image("t.png", 1);
    put("m.mtl", "newmtl a\nmap_Kd t.png\nnewmtl b\nmap_Kd ./t.png\nnewmtl c\nmap_Kd ././t.png\n");
    options = {};
    options.limits.texels = 8;
    report = {};
    const auto mesh = read_mesh(put("b.obj", "mtllib m.mtl\n" + faces), options, &report);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->images.size(), 2u);
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("12 texels; the limit is 8")));
}

TEST_F(HostileTest, WhatAMeshIsMadeOfIsBounded) {
    ReadOptions options;
    Document deep;
    deep.nodes = "[{\"children\":[1]},{\"children\":[2]},{\"mesh\":0}]";
    options.limits.gltf_depth = 2;
    EXPECT_TRUE(read_mesh(put("deep.gltf", deep.json()), options));
    options.limits.gltf_depth = 1;
    EXPECT_THAT(refusal(read_mesh(folder_ / "deep.gltf", options)), HasSubstr("the limit is 1"));
    // A material of glTF's own stands before those of the file.
    options = {};
    options.limits.materials = 2;
    EXPECT_TRUE(read_mesh(put("one.gltf", Document{}.json()), options));
    options.limits.materials = 1;
    EXPECT_THAT(refusal(read_mesh(folder_ / "one.gltf", options)), HasSubstr("2 materials; the limit is 1"));
    const std::string faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n";
    ReadReport report;
    auto mesh = read_mesh(put("two.obj", faces), options, &report);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->material_table.size(), 1u);
    EXPECT_THAT(report.warnings, Contains(HasSubstr("the limit of 1")));
    // A library that unpacks to too much makes white materials, as one that is not there does.
    const std::string library = "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n";
    gzFile packed = gzopen((folder_ / "long.mtl").c_str(), "wb");
    gzwrite(packed, library.data(), static_cast<unsigned>(library.size()));
    gzclose(packed);
    options = {};
    options.limits.library_bytes = 10;
    report = {};
    mesh = read_mesh(put("long.obj", "mtllib long.mtl\n" + faces), options, &report);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->material_table[0].base_colour, glm::vec4(1));
    EXPECT_THAT(report.warnings, Contains(HasSubstr("'long.mtl' cannot be read")));
}

TEST_F(HostileTest, GltfImagesReachNoFurtherThanTheirBuffer) {
    Document document;
    document.material = "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}";
    std::string json = document.json();
    json.insert(json.find("\"nodes\""),
                "\"images\":[{\"bufferView\":2,\"mimeType\":\"image/png\"}],\"textures\":[{\"source\":0}],");
    const std::string more = ",{\"buffer\":0,\"byteOffset\":32,\"byteLength\":90}";
    json.insert(json.find("],\"accessors\""), more);
    ReadReport report;
    ASSERT_TRUE(read_mesh(put("a.gltf", json), {}, &report));
    EXPECT_THAT(report.warnings, ElementsAre(HasSubstr("past the end of its buffer")));
}

// A file of 4 KB whose tile would take 854 MB.
TEST_F(HostileTest, TilesOfHeightsAreNoLargerThanTheirFileCanHold) {
    const auto read =
        read_mesh(std::filesystem::path(LODESTONE_SOURCE_DIR) / "tests/mesh/io/found/tile-larger-than-its-picture.tif");
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, testing::HasSubstr("has tiles of a wrong size"));
}

// What fuzzing found once (make fuzz), made small: read or refused, like anything else.
TEST_F(HostileTest, WhatWasFoundOnceIsReadOrRefused) {
    size_t files = 0;
    for (const auto& entry : fs::directory_iterator(fs::path(LODESTONE_SOURCE_DIR) / "tests/mesh/io/found")) {
        SCOPED_TRACE(entry.path().filename());
        ++files;
        const auto mesh = read_mesh(entry.path());
        if (mesh) {
            EXPECT_TRUE(mesh->validate());
        } else {
            EXPECT_FALSE(mesh.error().message.empty());
            EXPECT_EQ(mesh.error().message.find('\n'), std::string::npos);
        }
    }
    EXPECT_GT(files, 0u);
}

}  // namespace
}  // namespace lodestone
