#include "mesh/io/read.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <sys/resource.h>
#include <tiffio.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "fixtures/written_glbs.h"
#include "mesh/generate.h"
#include "mesh/io/write.h"
#include "mesh/repair.h"
#include "mesh/topology.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ReadTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_read_" + std::to_string(::getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path put(const std::string& name, const std::string& content) {
        std::ofstream(folder_ / name, std::ios::binary) << content;
        return folder_ / name;
    }
    TriMesh good(const std::string& name, const std::string& content, ReadReport* report = nullptr) {
        auto mesh = read_mesh(put(name, content), {}, report);
        EXPECT_TRUE(mesh) << mesh.error().message;
        if (!mesh) return {};
        EXPECT_TRUE(mesh->validate());
        return std::move(*mesh);
    }
    // The message, without the path.
    std::string refused(const std::string& name, const std::string& content) {
        const fs::path path = put(name, content);
        auto mesh = read_mesh(path);
        EXPECT_FALSE(mesh) << "was read";
        if (mesh) return "";
        EXPECT_EQ(mesh.error().fault, Fault::format);
        EXPECT_THAT(mesh.error().message, HasSubstr(path.string()));
        EXPECT_EQ(mesh.error().message.find('\n'), std::string::npos);
        return mesh.error().message.substr(path.string().size());
    }
    static std::string content_of(const fs::path& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    fs::path folder_;
};

const std::string ascii_ply =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty double y\nproperty "
    "float z\nproperty uchar red\nproperty uchar green\n"
    "property uchar blue\nproperty float quality\nelement face 1\nproperty list uchar int vertex_indices\nproperty int "
    "flags\nelement edge 1\nproperty int a\nproperty int b\nend_header\n"
    "0 0 0 255 0 0 0.5\n1 0 0 0 255 0 1\n1 1 0 0 0 255 1\n0 1 0 9 9 9 1\n4 0 1 2 3 7\n0 1\n";

TEST_F(ReadTest, PlyAsciiWithFurtherPropertiesAndAQuad) {
    ReadReport report;
    const TriMesh mesh = good("a.ply", ascii_ply, &report);
    EXPECT_EQ(report.format, MeshFormat::ply);
    EXPECT_EQ(report.polygons, 1u);
    ASSERT_EQ(mesh.triangle_count(), 2u);
    EXPECT_EQ(mesh.positions[2], glm::vec3(1, 1, 0));
    EXPECT_EQ(mesh.colours[1], glm::u8vec4(0, 255, 0, 255));
}

template <class T>
void put_number(std::string& to, T value, bool big) {
    std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
    if (big) std::reverse(raw.begin(), raw.end());
    to += raw;
}

TEST_F(ReadTest, PlyBinaryOfBothByteOrdersWithStrips) {
    for (const bool big : {false, true}) {
        SCOPED_TRACE(big);
        std::string ply = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                          "_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty short "
                          "z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n";
        for (int i = 0; i < 5; ++i) {
            put_number(ply, static_cast<float>(i / 2), big);
            put_number(ply, static_cast<float>(i % 2), big);
            put_number(ply, static_cast<int16_t>(0), big);
        }
        put_number(ply, int32_t{9}, big);
        for (const int32_t i : {0, 1, 2, 3, -1, 0, 2, 4, 4}) put_number(ply, i, big);
        const TriMesh mesh = good("strip.ply", ply);
        EXPECT_THAT(mesh.triangles, testing::ElementsAre(Triangle{0, 1, 2}, Triangle{2, 1, 3}, Triangle{0, 2, 4}));
    }
}

TEST_F(ReadTest, PlyRefusesLies) {
    EXPECT_THAT(refused("a.ply",
                        "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float "
                        "y\nproperty float z\nend_header\n0 0 0\n"),
                HasSubstr("promises 4000000000"));
    std::string cut = ascii_ply;
    cut.resize(cut.size() - 16);
    EXPECT_THAT(refused("b.ply", cut), HasSubstr("cut"));
    std::string range = ascii_ply;
    range.replace(range.find("4 0 1 2 3"), 9, "4 0 1 2 8");
    EXPECT_THAT(refused("c.ply", range), HasSubstr("refers to vertex 8; the file has 4"));
    std::string nan = ascii_ply;
    nan.replace(nan.find("1 0 0 0 255"), 1, "nan");
    EXPECT_THAT(refused("d.ply", nan), HasSubstr("vertex 1"));
    std::string word = ascii_ply;
    word.replace(word.find("1 1 0 0 0 255"), 1, "one");
    EXPECT_THAT(refused("e.ply", word), HasSubstr("line 21: 'one' is no number"));
    EXPECT_THAT(refused("f.ply", ""), HasSubstr("is empty"));
    EXPECT_THAT(refused("g.ply",
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
                        "z\nend_header\n0 0 0\n"),
                HasSubstr("no faces"));
}

TEST_F(ReadTest, ObjWithEverything) {
    put("m.mtl", "newmtl red\nKd 1 0 0\nmap_Kd missing.png\nnewmtl blue\nKd 0 0 1\nd 0.5\n");
    ReadReport report;
    const TriMesh mesh = good(
        "a.obj",
        "# a comment\nmtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n"
        "g group one\nusemtl red\nf 1/1/1 2/2/1 \\\n 3/3/1 4//1\nusemtl blue\nf -5//-1 -4//-1 -1//-1\n",
        &report);
    EXPECT_EQ(mesh.triangle_count(), 3u);
    EXPECT_EQ(mesh.vertex_count(), 5u);
    ASSERT_EQ(mesh.material_table.size(), 2u);
    EXPECT_EQ(mesh.material_table[1].base_colour, glm::vec4(0, 0, 1, 0.5f));
    EXPECT_EQ(mesh.material_table[0].base_colour_texture.image, -1);
    EXPECT_EQ(mesh.materials[mesh.triangles[2][0]], 1);
    EXPECT_EQ(mesh.uvs[mesh.triangles[0][2]], glm::vec2(1, 0));  // top left is the origin
    EXPECT_THAT(report.warnings, testing::ElementsAre(HasSubstr("missing.png")));
    EXPECT_TRUE(mesh.has_seams());  // vertices 1 and 2 have two materials
}

TEST_F(ReadTest, ObjRefusesByLine) {
    EXPECT_THAT(refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
                HasSubstr("line 4: refers to vertex 4; the file has 3"));
    EXPECT_THAT(refused("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"), HasSubstr("line 4"));
    EXPECT_THAT(refused("c.obj", "v 0 0 inf\n"), HasSubstr("line 1: a coordinate is not finite"));
    EXPECT_THAT(refused("d.obj", "v 0 0\n"), HasSubstr("three numbers"));
    EXPECT_THAT(refused("e.obj", "v 0 0 0\n"), HasSubstr("no faces"));
}

TEST_F(ReadTest, ObjGoesWithoutNormalsThatAreNotThere) {
    ReadReport report;
    const TriMesh mesh = good("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2//2 3//3\n", &report);
    EXPECT_TRUE(mesh.normals.empty());
    EXPECT_EQ(report.warnings.size(), 1u);
}

TEST_F(ReadTest, StlAsciiAndBinary) {
    const TriMesh text = good("a.stl",
                              "solid a facet of life\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 "
                              "0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n");
    EXPECT_EQ(text.triangle_count(), 1u);
    std::string binary = "solid but binary";
    binary.resize(80);
    put_number(binary, uint32_t{2}, false);
    for (int t = 0; t < 2; ++t) {
        for (const float x : {0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, static_cast<float>(t)})
            put_number(binary, x, false);
        put_number(binary, uint16_t{0}, false);
    }
    EXPECT_EQ(good("b.stl", binary).triangle_count(), 2u);
    EXPECT_THAT(refused("c.stl", binary.substr(0, binary.size() - 1)), HasSubstr("promises 2 facets"));
    EXPECT_THAT(
        refused("d.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n"),
        HasSubstr("2 vertices"));
    EXPECT_THAT(refused("e.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"), HasSubstr("cut"));
}

TEST_F(ReadTest, OffWithColoursAndComments) {
    const TriMesh mesh = good("a.off",
                              "COFF # colours\n4 2 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n1 1 0 0 0 255 255\n\n0 1 0 "
                              "1 2 3 4\n3 0 1 2 255 0 0\n3 0 2 3\n");
    EXPECT_EQ(mesh.triangle_count(), 2u);
    EXPECT_EQ(mesh.colours[3], glm::u8vec4(1, 2, 3, 4));
    EXPECT_THAT(refused("b.off", "OFF\n353535235358 6 0\n0 0 0\n"), HasSubstr("promises 353535235358"));
    EXPECT_THAT(refused("c.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), HasSubstr("line 6"));
}

TEST_F(ReadTest, WhatWritersWriteReadsBack) {
    fixtures::WrittenGlbs written;
    for (const auto& f : fixtures::manifold_meshes()) {
        for (const char* extension : {".ply", ".obj", ".glb"}) {
            SCOPED_TRACE(f.name + extension);
            const fs::path path = folder_ / ("mesh" + std::string(extension));
            ASSERT_TRUE(write_mesh(f.mesh, path));
            if (path.extension() == ".glb") written.keep(path);
            auto read = read_mesh(path);
            ASSERT_TRUE(read) << read.error().message;
            ASSERT_TRUE(repair(*read));
            const Topology a = topology_of(f.mesh), b = topology_of(*read);
            EXPECT_EQ(a.triangles, b.triangles);
            EXPECT_EQ(a.vertices, b.vertices);
            EXPECT_EQ(a.seam_edges, b.seam_edges);
            EXPECT_EQ(a.boundary_loops, b.boundary_loops);
            for (size_t t = 0; t < f.mesh.triangle_count(); ++t) {
                for (int k = 0; k < 3; ++k) ASSERT_EQ(read->position_of(t, k), f.mesh.position_of(t, k));
            }
        }
    }
    written.check();
}

TEST_F(ReadTest, MaterialsTexturesAndColoursSurviveGlbAndObj) {
    TriMesh mesh = fixtures::cube_with_seams();
    mesh.material_table.resize(2);
    mesh.material_table[0].name = "stone";
    mesh.material_table[0].base_colour = {0.5f, 0.25f, 1, 1};
    mesh.material_table[1].name = "painted";
    mesh.material_table[1].base_colour_texture.image = 0;
    mesh.material_table[1].double_sided = true;
    mesh.images = {{2, 1, {{255, 0, 0, 255}, {0, 255, 0, 255}}}};
    for (uint32_t w = 0; w < mesh.wedge_count(); ++w) {
        mesh.materials.push_back(w < 12 ? 0 : 1);
        mesh.colours.emplace_back(w * 10, 100, 255 - w * 10, 255);
    }
    fixtures::WrittenGlbs written;
    for (const char* extension : {".obj", ".glb"}) {
        SCOPED_TRACE(extension);
        TriMesh one = mesh;
        if (extension == std::string(".obj")) one.colours.clear();  // OBJ holds colours per position
        const fs::path path = folder_ / ("cube" + std::string(extension));
        ASSERT_TRUE(write_mesh(one, path));
        if (path.extension() == ".glb") written.keep(path);
        ReadReport report;
        auto read = read_mesh(path, {}, &report);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_TRUE(report.warnings.empty());
        ASSERT_EQ(read->images.size(), 1u);
        EXPECT_EQ(read->images[0].texels, mesh.images[0].texels);
        std::multiset<std::string> before, after;
        const auto corners = [](const TriMesh& m) {
            std::multiset<std::string> all;
            for (size_t t = 0; t < m.triangle_count(); ++t) {
                for (int k = 0; k < 3; ++k) {
                    const uint32_t w = m.triangles[t][static_cast<size_t>(k)];
                    const glm::vec3 p = m.position_of(t, k);
                    std::string text = std::to_string(p.x) + std::to_string(p.y) + std::to_string(p.z) +
                                       m.material_table[m.materials[w]].name;
                    if (!m.colours.empty())
                        text += std::to_string(m.colours[w].x) + "," + std::to_string(m.colours[w].z);
                    all.insert(text);
                }
            }
            return all;
        };
        EXPECT_EQ(corners(one), corners(*read));
    }
    written.check();
}

TEST_F(ReadTest, GzipIsLookedThrough) {
    const fs::path path = folder_ / "a.ply.gz";
    gzFile gz = gzopen(path.c_str(), "wb");
    gzwrite(gz, ascii_ply.data(), static_cast<unsigned>(ascii_ply.size()));
    gzclose(gz);
    auto mesh = read_mesh(path);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangle_count(), 2u);
    const std::string packed = content_of(path);
    refused("b.ply.gz", packed.substr(0, packed.size() / 2));
}

TEST_F(ReadTest, UnknownContentIsRefusedByNamingTheFormats) {
    EXPECT_THAT(refused("a.xyz", "hello"), HasSubstr("PLY, OBJ, STL, OFF"));
}

TEST_F(ReadTest, GltfNodesInstancesAndMirroring) {
    ASSERT_TRUE(write_mesh(fixtures::tetrahedron(), folder_ / "t.glb"));
    std::string glb = content_of(folder_ / "t.glb");
    // The same mesh twice: as it is, and mirrored and moved.
    const std::string from = "\"nodes\":[{\"mesh\":0}]";
    std::string json = glb.substr(20, *reinterpret_cast<const uint32_t*>(glb.data() + 12));
    ASSERT_NE(json.find(from), std::string::npos);
    json.replace(json.find(from), from.size(),
                 "\"nodes\":[{\"mesh\":0,\"children\":[1]},{\"mesh\":0,\"scale\":[-1,1,1],\"translation\":[5,0,0]}]");
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const std::string bin = glb.substr(20 + *reinterpret_cast<const uint32_t*>(glb.data() + 12));
    std::string two = glb.substr(0, 8);
    put_number(two, static_cast<uint32_t>(20 + json.size() + bin.size()), false);
    put_number(two, static_cast<uint32_t>(json.size()), false);
    two += "JSON" + json + bin;
    TriMesh mesh = good("two.glb", two);
    EXPECT_EQ(mesh.triangle_count(), 8u);
    const auto report = repair(mesh);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->flipped_triangles, 0u);  // the mirrored one was turned already
    EXPECT_EQ(topology_of(mesh).components, 2u);
}

TEST_F(ReadTest, GltfRefusesWhatItCannotDecode) {
    const auto with = [](const std::string& more) { return "{\"asset\":{\"version\":\"2.0\"}" + more + "}"; };
    EXPECT_THAT(refused("a.gltf", with(",\"extensionsUsed\":[\"EXT_other_shape\"],\"extensionsRequired\":["
                                       "\"EXT_other_shape\"]")),
                HasSubstr("EXT_other_shape"));
    EXPECT_THAT(refused("b.gltf", "{\"asset\":"), HasSubstr("no glTF"));
    EXPECT_THAT(refused("c.gltf", with("")), HasSubstr("no triangles"));
    EXPECT_THAT(
        refused("d.gltf",
                with(",\"buffers\":[{\"byteLength\":12,\"uri\":\"data:application/"
                     "octet-stream;base64,AAAAAAAAAAAAAAAA\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":12}],"
                     "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":1000000,\"type\":\"VEC3\"}],"
                     "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"nodes\":[{\"mesh\":0}],"
                     "\"scenes\":[{\"nodes\":[0]}]")),
        HasSubstr("past the end"));
    EXPECT_THAT(
        refused("e.gltf", with(",\"nodes\":[{\"children\":[1]},{\"children\":[0]}],\"scenes\":[{\"nodes\":[0]}]")),
        HasSubstr("circle"));
}

fs::path write_heights(const fs::path& path, const std::vector<uint16_t>& samples, uint32_t width, uint32_t height) {
    FILE* file = std::fopen(path.c_str(), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_set_IHDR(png, info, width, height, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    png_set_swap(png);
    for (uint32_t y = 0; y < height; ++y)
        png_write_row(png, reinterpret_cast<png_const_bytep>(samples.data() + size_t{y} * width));
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &info);
    std::fclose(file);
    return path;
}

TEST_F(ReadTest, HeightMapsBecomeTerrainWithHoles) {
    std::vector<uint16_t> samples(5 * 5, 100);
    samples[2 * 5 + 2] = 0x8000;  // a void of the Shuttle Radar Topography Mission
    samples[0] = 250;
    ReadOptions options;
    options.height_scale = 2;
    options.pixel_size = 30;
    ReadReport report;
    auto mesh = read_mesh(write_heights(folder_ / "h.png", samples, 5, 5), options, &report);
    ASSERT_TRUE(mesh) << mesh.error().message;
    options.limits.height_side = 5;
    EXPECT_TRUE(read_mesh(folder_ / "h.png", options));
    options.limits.height_side = 4;
    EXPECT_THAT(read_mesh(folder_ / "h.png", options).error().message, HasSubstr("the limit is 4"));
    EXPECT_EQ(report.format, MeshFormat::png_heights);
    EXPECT_EQ(mesh->vertex_count(), 24u);
    EXPECT_EQ(mesh->triangle_count(), 2 * 16u - 4);  // four cells lose one of their two triangles
    const Box box = bounding_box(mesh->positions);
    EXPECT_EQ(box.high.y, 500);
    EXPECT_EQ(box.low.y, 200);
    EXPECT_EQ(box.high.x - box.low.x, 120);
    EXPECT_EQ(topology_of(*mesh).boundary_loops, 2u);
    mesh->normals.clear();
    compute_normals(*mesh);
    for (const glm::vec3& n : mesh->normals) EXPECT_GT(n.y, 0);
}

TEST_F(ReadTest, FillsVoidsOfHeightMapsFromAroundThem) {
    // A slope with voids of both kinds: a block at the edge, one inside, and single samples.
    constexpr uint32_t side = 40;
    std::vector<uint16_t> samples;
    const auto slope = [](uint32_t x, uint32_t y) { return 1000 + 20 * x + 10 * y; };
    size_t voids = 0;
    for (uint32_t y = 0; y < side; ++y) {
        for (uint32_t x = 0; x < side; ++x) {
            const bool inside = x >= 10 && x < 18 && y >= 12 && y < 20, edge = x < 5 && y >= 30 && y < 36;
            const bool alone = x % 13 == 5 && y % 11 == 3;
            voids += inside || edge || alone;
            samples.push_back(static_cast<uint16_t>(inside || edge ? 0x8000 : alone ? 7 : slope(x, y)));
        }
    }
    const fs::path path = write_heights(folder_ / "v.png", samples, side, side);
    ReadOptions options;
    options.void_height = 7;
    ReadReport report;
    auto holes = read_mesh(path, options, &report);
    ASSERT_TRUE(holes) << holes.error().message;
    EXPECT_LT(holes->triangle_count(), size_t{2} * 39 * 39 - voids);
    EXPECT_THAT(report.warnings, testing::ElementsAre(HasSubstr("they are holes")));
    options.fill_voids = true;
    report = {};
    auto filled = read_mesh(path, options, &report);
    ASSERT_TRUE(filled) << filled.error().message;
    EXPECT_THAT(report.warnings,
                testing::ElementsAre(std::to_string(voids) + " samples held no data; they were filled from around"));
    EXPECT_EQ(filled->triangle_count(), 2u * 39 * 39);
    for (size_t v = 0; v < filled->vertex_count(); ++v) {
        const glm::vec3& p = filled->positions[v];
        const auto x = static_cast<uint32_t>(p.x + 19.5f), y = static_cast<uint32_t>(p.z + 19.5f);
        const uint16_t given = samples[y * side + x];
        if (given != 7 && given != 0x8000) {
            EXPECT_EQ(p.y, given);
        } else {
            // A slope goes on as a slope; at the map's edge it levels off.
            EXPECT_NEAR(p.y, static_cast<float>(slope(x, y)), x < 5 && y >= 30 ? 60 : 8) << x << " " << y;
        }
    }
    const std::vector<uint16_t> nothing(9, 0x8000);
    options = {};
    options.fill_voids = true;
    EXPECT_THAT(read_mesh(write_heights(folder_ / "n.png", nothing, 3, 3), options).error().message,
                HasSubstr("nothing to read"));
}

TEST_F(ReadTest, TellsOfHeightsThatMayStandForNoData) {
    // A bumpy slope from the sea up, with a lake; then with pits among the mountains.
    constexpr uint32_t side = 40;
    std::vector<uint16_t> samples;
    for (uint32_t y = 0; y < side; ++y) {
        for (uint32_t x = 0; x < side; ++x) {
            const bool lake = x >= 20 && x < 28 && y >= 12 && y < 20;
            const uint32_t ground = 100 + 20 * (x < 6 ? 0 : x - 6) + (x * 7 + y * 11) % 13;
            samples.push_back(static_cast<uint16_t>(lake ? 460 : x < 6 ? 100 : ground));
        }
    }
    ReadReport report;
    ASSERT_TRUE(read_mesh(write_heights(folder_ / "lake.png", samples, side, side), {}, &report));
    EXPECT_THAT(report.warnings, testing::IsEmpty());
    std::vector<uint16_t> pits = samples;
    for (uint32_t y = 0; y < side; ++y) pits[y * side + 12 + y % 25] = 100;
    const std::string pit_count = std::to_string(std::ranges::count(pits, 100));
    const fs::path path = write_heights(folder_ / "pits.png", pits, side, side);
    ASSERT_TRUE(read_mesh(path, {}, &report));
    EXPECT_THAT(report.warnings,
                testing::ElementsAre(testing::AllOf(HasSubstr(pit_count + " samples are 100, far from"),
                                                    HasSubstr("`--void-height 100`"))));
    ReadOptions options;
    options.void_height = 100;
    report = {};
    ASSERT_TRUE(read_mesh(path, options, &report));
    EXPECT_THAT(report.warnings, testing::ElementsAre(HasSubstr("they are holes")));
}

TEST_F(ReadTest, GeoTiffBringsItsOwnSpacingAndNoData) {
    const fs::path path = folder_ / "h.tif";
    static const TIFFFieldInfo fields[] = {
        {33550, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, const_cast<char*>("ModelPixelScaleTag")},
        {42113, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("GDAL_NODATA")}};
    TIFF* tiff = TIFFOpen(path.c_str(), "w");
    TIFFMergeFieldInfo(tiff, fields, 2);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 4u);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 3u);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_INT);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 3);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    double scale[3] = {10, 20, 0};
    TIFFSetField(tiff, 33550, 3, scale);
    TIFFSetField(tiff, 42113, "-9999");
    int16_t rows[3][4] = {{-5, 0, 7, -9999}, {1, 1, 1, 1}, {-32768, 1, 1, 1}};
    for (uint32_t y = 0; y < 3; ++y) TIFFWriteScanline(tiff, rows[y], y, 0);
    TIFFClose(tiff);
    auto mesh = read_mesh(path);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->vertex_count(), 10u);
    const Box box = bounding_box(mesh->positions);
    EXPECT_EQ(box.high.x - box.low.x, 30);
    EXPECT_EQ(box.high.z - box.low.z, 40);
    EXPECT_EQ(box.low.y, -5);
    const std::string content = content_of(path);
    refused("cut.tif", content.substr(0, 12));
}

TEST_F(ReadTest, StreamsDeliverTheSameMeshInBoundedBatches) {
    const TriMesh source = generate(Shape::rock, 5000, 1);
    for (const char* extension : {".ply", ".obj"}) {
        SCOPED_TRACE(extension);
        const fs::path path = folder_ / ("rock" + std::string(extension));
        ASSERT_TRUE(write_mesh(source, path));
        const auto whole = read_mesh(path);
        ASSERT_TRUE(whole);
        auto stream = open_mesh_stream(path);
        ASSERT_TRUE(stream);
        MeshBatch batch;
        TriMesh gathered;
        for (;;) {
            const auto more = (*stream)->next(batch, 100);
            ASSERT_TRUE(more);
            if (!*more) break;
            EXPECT_LE(batch.positions.size() + batch.triangles.size(), 100u);
            gathered.positions.insert(gathered.positions.end(), batch.positions.begin(), batch.positions.end());
            for (const Triangle& t : batch.triangles) {
                for (const uint32_t v : t) ASSERT_LT(v, gathered.positions.size());
                gathered.triangles.push_back(t);
            }
        }
        EXPECT_EQ(gathered.triangles, whole->triangles);
        EXPECT_EQ(gathered.positions.size(), whole->wedge_count());
    }
}

// Whatever one does to a file, it is read or refused with one line; nothing crashes, nothing is read out of range.
TEST_F(ReadTest, DamagedFilesAreReadOrRefused) {
    TriMesh mesh = fixtures::cube_with_seams();
    std::vector<std::pair<std::string, std::string>> sources = {{"a.ply", ascii_ply}};
    for (const char* name : {"b.ply", "c.obj", "d.glb"}) {
        ASSERT_TRUE(write_mesh(mesh, folder_ / name));
        sources.emplace_back(name, content_of(folder_ / name));
    }
    sources.emplace_back("e.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n");
    sources.emplace_back("f.stl",
                         "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
                         "0\nendloop\nendfacet\nendsolid\n");
    write_heights(folder_ / "g.png", std::vector<uint16_t>(64, 7), 8, 8);
    sources.emplace_back("g.png", content_of(folder_ / "g.png"));
    Random random(1);
    for (const auto& [name, content] : sources) {
        int refusals = 0;
        for (int round = 0; round < 400; ++round) {
            std::string damaged = content;
            const int kind = static_cast<int>(random.below(4));
            const size_t at = random.below(static_cast<uint32_t>(damaged.size()));
            if (kind == 0) {
                damaged.resize(at);
            } else if (kind == 1) {
                damaged.erase(at, 1 + random.below(8));
            } else {
                for (int k = 0; k < (kind == 2 ? 1 : 6); ++k)
                    damaged[random.below(static_cast<uint32_t>(damaged.size()))] = static_cast<char>(random.below(256));
            }
            const fs::path path = put(name, damaged);
            const auto read = read_mesh(path);
            if (read) {
                EXPECT_TRUE(read->validate());
            } else {
                ++refusals;
                EXPECT_FALSE(read.error().message.empty());
                EXPECT_EQ(read.error().message.find('\n'), std::string::npos) << read.error().message;
            }
        }
        EXPECT_GT(refusals, 50) << name;
    }
}

// A texture that cannot be opened just now is not one that is not there: the mesh would be baked without it for good.
TEST_F(ReadTest, ASideFileThatTheMachineCannotOpenIsTheMachinesFault) {
    put("a.mtl", "newmtl red\nKd 1 0 0\n");
    const fs::path path = put("a.obj", "mtllib a.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    ASSERT_TRUE(read_mesh(path));
    const int next = ::dup(0);
    ::close(next);
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
    rlimit one_more = before;
    one_more.rlim_cur = static_cast<rlim_t>(next) + 1;
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &one_more), 0);
    const auto mesh = read_mesh(path);
    const auto hash = hash_of_source(path);
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().fault, Fault::machine);
    EXPECT_THAT(mesh.error().message, HasSubstr("a.obj: 'a.mtl': cannot be opened"));
    ASSERT_FALSE(hash);
    EXPECT_EQ(hash.error().fault, Fault::machine);
}

}  // namespace
}  // namespace lodestone
