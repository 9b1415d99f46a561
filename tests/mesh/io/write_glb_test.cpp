// GLB as it is written: read back, and looked at by Khronos' validator where npm has it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "fixtures/materials.h"
#include "fixtures/meshes.h"
#include "fixtures/written_glbs.h"
#include "mesh/io/image_file.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using Encoding = WriteOptions::Encoding;
using Textures = WriteOptions::Textures;

class WriteGlbTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_glb_" + std::to_string(::getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override {
        written_.check();
        fs::remove_all(folder_);
    }
    // Writes it; the validator sees it, too, where it is a GLB.
    bool written(const TriMesh& mesh, const std::string& name, const WriteOptions& options = {}) {
        if (!write_mesh(mesh, folder_ / name, options)) return false;
        if (name.ends_with(".glb")) written_.keep(folder_ / name);
        return true;
    }
    fs::path folder_;
    fixtures::WrittenGlbs written_;
};

// With every attribute, two materials and a texture.
TriMesh rich_mesh() {
    TriMesh mesh = fixtures::cube_with_seams();
    mesh.colours.assign(mesh.wedge_count(), glm::u8vec4(200, 100, 50, 255));
    mesh.materials.assign(mesh.wedge_count(), 0);
    for (size_t t = 6; t < mesh.triangle_count(); ++t) {
        for (const uint32_t w : mesh.triangles[t]) mesh.materials[w] = 1;
    }
    mesh.material_table.resize(2);
    mesh.material_table[1].base_colour_texture.image = 0;
    mesh.material_table[1].double_sided = true;
    Image image{4, 4, {}};
    image.texels.assign(16, {9, 99, 199, 255});
    mesh.images.push_back(image);
    return mesh;
}

std::vector<TriMesh> meshes() {
    return {rich_mesh(), fixtures::mesh_of_every_material(), fixtures::mesh_of_tangents(), fixtures::torus(20, 12),
            fixtures::repaired(Shape::vase, 2000)};
}

// The wedge that a wedge of the mesh became in the primitive of material 'all', which alone has a second set. Past the
// end where it has none.
size_t second_in(const TriMesh& read, const TriMesh& mesh, size_t wedge) {
    if (mesh.second_uvs.empty()) return read.wedge_count();
    EXPECT_EQ(read.second_uvs.size(), read.wedge_count());
    size_t first = 0;
    while (read.material_table[read.materials[first]].name != "all") ++first;
    return first + wedge;
}

TEST_F(WriteGlbTest, EveryEncodingReadsBackWithinQuantisation) {
    for (const TriMesh& mesh : meshes()) {
        for (const Encoding encoding : {Encoding::plain, Encoding::quantised, Encoding::meshopt}) {
            SCOPED_TRACE(static_cast<int>(encoding));
            WriteOptions options;
            options.encoding = encoding;
            ASSERT_TRUE(write_mesh(mesh, folder_ / "a.glb", options));
            ReadReport told;
            const auto read = read_mesh(folder_ / "a.glb", {}, &told);
            ASSERT_TRUE(read) << read.error().message;
            EXPECT_TRUE(told.warnings.empty());
            // Each primitive brings its vertices, which here are all.
            ASSERT_EQ(read->positions.size() % mesh.wedge_count(), 0u);
            ASSERT_EQ(read->triangle_count(), mesh.triangle_count());
            const float allowed = encoding == Encoding::plain ? 0 : bounding_box(mesh.positions).diagonal() / 65535;
            for (size_t w = 0; w < mesh.wedge_count(); ++w) {
                EXPECT_LE(glm::distance(read->positions[w], mesh.positions[mesh.wedge_vertex[w]]), allowed);
                if (!mesh.normals.empty()) { EXPECT_GT(glm::dot(read->normals[w], mesh.normals[w]), 0.999999f); }
                if (!mesh.uvs.empty()) {
                    EXPECT_LE(glm::distance(read->uvs[w], mesh.uvs[w]), encoding == Encoding::plain ? 0 : 2e-5f);
                }
                if (const size_t second = second_in(*read, mesh, w); second < read->wedge_count()) {
                    EXPECT_LE(glm::distance(read->second_uvs[second], mesh.second_uvs[w]),
                              encoding == Encoding::plain ? 0 : 2e-5f);
                }
                if (!mesh.colours.empty()) { EXPECT_EQ(read->colours[w], mesh.colours[w]); }
            }
            EXPECT_EQ(read->images.size(), mesh.images.size());
        }
    }
}

// By the places of its corners, each with its tangent.
using TangentsOfTriangle = std::vector<std::pair<std::array<int, 3>, glm::vec4>>;
std::vector<TangentsOfTriangle> tangents_of(const TriMesh& mesh) {
    std::vector<TangentsOfTriangle> all;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        TangentsOfTriangle triangle;
        for (int k = 0; k < 3; ++k) {
            const glm::ivec3 p(glm::round(mesh.position_of(t, k) * 100.0f));
            triangle.push_back({{p.x, p.y, p.z}, mesh.tangents.at(mesh.triangles[t][static_cast<size_t>(k)])});
        }
        std::ranges::sort(triangle, {}, [](const auto& corner) { return corner.first; });
        all.push_back(triangle);
    }
    std::ranges::sort(all, {}, [](const auto& t) { return std::array{t[0].first, t[1].first, t[2].first}; });
    return all;
}

TEST_F(WriteGlbTest, TangentsComeBackWhereTheyAre) {
    const TriMesh mesh = fixtures::mesh_of_tangents();
    ASSERT_TRUE(mesh.validate()) << mesh.validate().error().message;
    const auto expected = tangents_of(mesh);
    for (const Encoding encoding : {Encoding::plain, Encoding::quantised, Encoding::meshopt}) {
        WriteOptions options;
        options.encoding = encoding;
        ASSERT_TRUE(write_mesh(mesh, folder_ / "a.glb", options));
        auto read = read_mesh(folder_ / "a.glb");
        ASSERT_TRUE(read) << read.error().message;
        ASSERT_EQ(read->tangents.size(), read->wedge_count());
        const auto found = tangents_of(*read);
        ASSERT_EQ(found.size(), expected.size());
        size_t none = 0;
        for (size_t t = 0; t < found.size(); ++t) {
            for (size_t k = 0; k < 3; ++k) {
                EXPECT_EQ(found[t][k].first, expected[t][k].first);
                const glm::vec4 &is = found[t][k].second, &was = expected[t][k].second;
                EXPECT_EQ(is.w, was.w);
                EXPECT_LE(glm::distance(glm::vec3(is), glm::vec3(was)), encoding == Encoding::plain ? 1e-6f : 5e-5f);
                none += was.w == 0 ? 1 : 0;
            }
        }
        EXPECT_EQ(none, 6u) << "of the side that has none";
    }
}

// Textures where they were, within rounding.
void expect_same_place(const Texture& a, const Texture& b) {
    EXPECT_EQ(a.wrap, b.wrap);
    EXPECT_EQ(a.second, b.second);
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(a.place[k].x, b.place[k].x, 1e-5f);
        EXPECT_NEAR(a.place[k].y, b.place[k].y, 1e-5f);
    }
}

TEST_F(WriteGlbTest, MaterialsComeBackWhole) {
    const TriMesh mesh = fixtures::mesh_of_every_material();
    EXPECT_TRUE(lost_in_writing(mesh, folder_ / "a.glb").empty());
    ASSERT_TRUE(write_mesh(mesh, folder_ / "a.glb"));
    const auto read = read_mesh(folder_ / "a.glb");
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->material_table.size(), mesh.material_table.size() + 1);
    const auto texels_of = [](const TriMesh& of, const Texture& texture) {
        return texture.there() ? of.images.at(static_cast<size_t>(texture.image)).texels : std::vector<glm::u8vec4>();
    };
    for (size_t m = 0; m < mesh.material_table.size(); ++m) {
        Material expected = mesh.material_table[m], found = read->material_table[m + 1];
        SCOPED_TRACE(expected.name);
        for (size_t k = 0; k < texture_names.size(); ++k) {
            Texture &a = *expected.textures()[k], &b = *found.textures()[k];
            EXPECT_EQ(texels_of(mesh, a), texels_of(*read, b));
            expect_same_place(a, b);
            a = b = {};
        }
        if (expected.shading == Shading::plain) expected.shading = Shading::metallic_roughness;
        EXPECT_EQ(expected, found);
    }
}

TEST_F(WriteGlbTest, AMeshOfOneMaterialNeedNotNameItForEachWedge) {
    TriMesh mesh = fixtures::cube_with_seams();
    mesh.material_table.resize(1);
    mesh.material_table[0].name = "clay";
    mesh.material_table[0].base_colour = {0.5f, 0.25f, 0.125f, 1};
    for (const char* file : {"clay.glb", "clay.obj"}) {
        ASSERT_TRUE(written(mesh, file));
        const auto read = read_mesh(folder_ / file);
        ASSERT_TRUE(read) << read.error().message;
        ASSERT_FALSE(read->material_table.empty()) << file;
        const Material& material = read->material_table[read->materials.empty() ? 0 : read->materials[0]];
        EXPECT_EQ(material.name, "clay") << file;
        EXPECT_NEAR(material.base_colour.y, 0.25f, 1e-6f) << file;
    }
}

TEST_F(WriteGlbTest, TexturesThatNoTransformPlacesAreLeftOutAndNamed) {
    TriMesh mesh = fixtures::mesh_of_every_material();
    mesh.material_table[1].emission_texture.place = {{1, 0}, {0.5f, 1}, {0, 0}};  // sheared
    EXPECT_THAT(lost_in_writing(mesh, folder_ / "a.glb"),
                testing::ElementsAre(testing::HasSubstr("material 'all': its texture of emission is left out")));
    ASSERT_TRUE(written(mesh, "a.glb"));
    const auto read = read_mesh(folder_ / "a.glb");
    ASSERT_TRUE(read);
    EXPECT_FALSE(read->material_table[2].emission_texture.there());
    EXPECT_EQ(read->material_table[2].emission, glm::vec3(0));
    EXPECT_TRUE(read->material_table[2].normal_texture.there());
    // Nor are there any without texture coordinates.
    mesh.second_uvs.clear();
    ASSERT_TRUE(written(mesh, "a.glb"));
    const auto first = read_mesh(folder_ / "a.glb");
    ASSERT_TRUE(first);
    EXPECT_TRUE(first->material_table[2].base_colour_texture.there());
    EXPECT_FALSE(first->material_table[2].normal_texture.there());
    mesh.uvs.clear();
    ASSERT_TRUE(written(mesh, "a.glb"));
    const auto bare = read_mesh(folder_ / "a.glb");
    ASSERT_TRUE(bare);
    EXPECT_TRUE(bare->images.empty());
}

TEST_F(WriteGlbTest, ObjHoldsWhatMtlHasWordsFor) {
    const TriMesh mesh = fixtures::mesh_of_every_material();
    const auto kinds_lost = [&](const TriMesh& of) {
        const auto lines = lost_in_writing(of, folder_ / "a.obj");
        return std::ranges::count_if(lines,
                                     [](const auto& line) { return line.find("the textures of ") != line.npos; });
    };
    const auto lines = lost_in_writing(mesh, folder_ / "a.obj");
    for (const char* line : {"the textures of metallic-roughness of 1 materials", "the textures of normals of 1",
                             "the textures of occlusion of 1", "the textures of emission of 1",
                             "the wrap of textures of 1", "the unlit shading of 1", "the second side of 1",
                             "the cutoff of masks of 1", "the second set of texture coordinates"})
        EXPECT_THAT(lines, testing::Contains(testing::HasSubstr("OBJ does not hold " + std::string(line))).Times(1));
    TriMesh fits = mesh;
    for (Texture* texture : fits.material_table[1].textures()) texture->place = Texture{}.place;
    EXPECT_EQ(kinds_lost(fits), 4) << "nor does it hold a second set";
    for (Texture* texture : fits.material_table[1].textures()) texture->second = false;
    EXPECT_EQ(kinds_lost(fits), 2);
    fits.material_table[1].base_colour = {1, 1, 1, 0.75f};  // of maps
    ASSERT_TRUE(write_mesh(fits, folder_ / "a.obj"));
    ReadReport told;
    const auto read = read_mesh(folder_ / "a.obj", {}, &told);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(told.warnings.empty());
    ASSERT_EQ(read->material_table.size(), 4u);
    const Material &all = read->material_table[1], &glass = read->material_table[3];
    EXPECT_EQ(read->material_table[0].shading, Shading::plain);
    EXPECT_EQ(all.shading, Shading::metallic_roughness);
    EXPECT_EQ(all.base_colour, glm::vec4(1, 1, 1, 0.75f));
    EXPECT_EQ(all.metallic, 0) << "without its texture";
    EXPECT_EQ(all.roughness, 0.375f);
    EXPECT_EQ(all.emission, glm::vec3(4, 2, 1));
    EXPECT_EQ(all.normal_scale, 0.625f);
    EXPECT_EQ(all.alpha_mode, AlphaMode::mask);
    const auto texels_of = [&](const Texture& texture) {
        return read->images.at(static_cast<size_t>(texture.image)).texels;
    };
    EXPECT_EQ(texels_of(all.base_colour_texture), mesh.images[0].texels);
    EXPECT_EQ(texels_of(all.normal_texture), mesh.images[2].texels);
    EXPECT_EQ(texels_of(all.emission_texture), mesh.images[3].texels);
    EXPECT_EQ(glass.alpha_mode, AlphaMode::blend);
    EXPECT_EQ(glass.base_colour.w, 0.5f);
    EXPECT_EQ(glass.emission, glm::vec3(0.5f, 0, 0));
}

TEST_F(WriteGlbTest, PlyIsWrittenWithALineForWhatItDoesNotHold) {
    const TriMesh mesh = fixtures::mesh_of_every_material();
    EXPECT_THAT(lost_in_writing(mesh, folder_ / "a.ply"),
                testing::ElementsAre("PLY does not hold the textures of 2 materials; GLB does",
                                     "PLY does not hold colours and other factors of 4 materials; GLB does",
                                     "PLY does not hold the second set of texture coordinates; GLB does"));
    EXPECT_THAT(lost_in_writing(fixtures::mesh_of_tangents(), folder_ / "a.ply"),
                testing::Contains("PLY does not hold tangents; GLB does"));
    EXPECT_THAT(lost_in_writing(fixtures::cube_with_seams(), folder_ / "a.ply"), testing::IsEmpty());
    EXPECT_THAT(lost_in_writing(fixtures::cube_with_seams(), folder_ / "a.obj"), testing::IsEmpty());
}

// A picture of a window, of which the panes let through half.
TEST_F(WriteGlbTest, ObjOfWhatIsBlendedByItsTextureHasItsAlpha) {
    TriMesh mesh = fixtures::cube_with_seams();
    mesh.uvs.assign(mesh.wedge_count(), glm::vec2(0));
    mesh.materials.assign(mesh.wedge_count(), 0);
    mesh.colours.clear();
    Material window;
    window.name = "window";
    window.alpha_mode = AlphaMode::blend;
    window.base_colour_texture.image = 0;
    mesh.material_table = {window};
    WriteOptions options;
    const auto written = [&](uint8_t alpha) {
        mesh.images = {Image{1, 1, {{10, 20, 30, alpha}}}};
        EXPECT_TRUE(write_mesh(mesh, folder_ / "a.obj", options));
        std::ifstream in(folder_ / "a.mtl");
        return std::string{std::istreambuf_iterator<char>(in), {}};
    };
    EXPECT_THAT(written(128), testing::HasSubstr("map_d a-0.png"));
    EXPECT_THAT(lost_in_writing(mesh, folder_ / "a.obj"),
                testing::ElementsAre("OBJ does not hold blending by a texture, which is written as a mask, of 1 "
                                     "materials; GLB does"));
    const auto read = read_mesh(folder_ / "a.obj");
    ASSERT_TRUE(read);
    EXPECT_NE(read->material_table[0].alpha_mode, AlphaMode::opaque);
    EXPECT_THAT(written(255), testing::Not(testing::HasSubstr("map_d")));
    options.textures = Textures::jpeg;
    EXPECT_THAT(written(128), testing::Not(testing::HasSubstr("map_d"))) << "JPEG has no alpha";
    mesh.images[0].texels[0].w = 255;
    EXPECT_THAT(lost_in_writing(mesh, folder_ / "a.obj"), testing::IsEmpty());
}

TEST_F(WriteGlbTest, WebpTexturesComeBack) {
    const TriMesh mesh = fixtures::mesh_of_every_material();
    WriteOptions options;
    options.textures = Textures::webp;
    const auto fully_read = [&](const char* name) {
        ReadReport told;
        auto read = read_mesh(folder_ / name, {}, &told);
        EXPECT_TRUE(read) << read.error().message;
        EXPECT_THAT(told.warnings, testing::IsEmpty());
        return read ? std::move(*read) : TriMesh{};
    };
    ASSERT_TRUE(written(mesh, "png.glb"));
    const std::vector<Material> table = fully_read("png.glb").material_table;
    for (const int quality : {80, 100}) {
        options.quality = quality;
        ASSERT_TRUE(written(mesh, "a.glb", options));
        const TriMesh read = fully_read("a.glb");
        EXPECT_EQ(read.material_table, table);
        ASSERT_EQ(read.images.size(), 4u);
        for (size_t i = 0; i < 4; ++i) {
            EXPECT_EQ(read.images[i].texels[1].w, mesh.images[i].texels[1].w) << "alpha comes along";
            EXPECT_EQ(read.images[i].texels == mesh.images[i].texels, quality == 100) << i;
        }
    }
    ASSERT_TRUE(written(mesh, "c.obj", options));
    EXPECT_TRUE(fs::exists(folder_ / "c-0.webp"));
    EXPECT_EQ(fully_read("c.obj").images.at(0).texels, mesh.images[0].texels);
    const Image wide{16384, 1, std::vector<glm::u8vec4>(16384)};
    const auto refused = encode_webp(wide, 90);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().fault, Fault::usage);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("16384x1 texels is larger than 16383 a side"));
}

TEST_F(WriteGlbTest, CompressedIsSmaller) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 20000);
    std::vector<uintmax_t> sizes;
    for (const Encoding encoding : {Encoding::plain, Encoding::quantised, Encoding::meshopt}) {
        WriteOptions options;
        options.encoding = encoding;
        ASSERT_TRUE(write_mesh(mesh, folder_ / "a.glb", options));
        sizes.push_back(fs::file_size(folder_ / "a.glb"));
    }
    EXPECT_LT(sizes[1], sizes[0] * 0.8);
    EXPECT_LT(sizes[2], sizes[0] * 0.4);
}

TEST_F(WriteGlbTest, KhronosValidatorFindsNoErrors) {
    int number = 0;
    for (const TriMesh& mesh : meshes()) {
        for (const Encoding encoding : {Encoding::plain, Encoding::quantised, Encoding::meshopt}) {
            for (const Textures textures : {Textures::png, Textures::jpeg, Textures::webp}) {
                WriteOptions options;
                options.encoding = encoding;
                options.textures = textures;
                ASSERT_TRUE(write_mesh(mesh, folder_ / (std::to_string(number++) + ".glb"), options));
            }
        }
    }
    const fixtures::NodeEnd end = fixtures::run_node("validate.mjs", folder_, ".");
    if (end.is_missing()) GTEST_SKIP() << fixtures::missing_npm_note();
    EXPECT_EQ(end.code, 0) << end.printed;
    EXPECT_THAT(end.printed, testing::HasSubstr("45 files"));
    // It does find something where there is something.
    std::fstream file(folder_ / "0.glb", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(8);
    file.write("\0\0\1\0", 4);
    file.close();
    EXPECT_EQ(fixtures::run_node("validate.mjs", folder_, ".").code, 1);
}

}  // namespace
}  // namespace lodestone
