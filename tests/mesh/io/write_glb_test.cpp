// GLB as it is written: read back, and looked at by Khronos' validator where npm has it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>

#include "fixtures/meshes.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using Encoding = WriteOptions::Encoding;

class WriteGlbTest : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("lodestone_glb_" + std::to_string(::getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path folder_;
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

std::vector<TriMesh> meshes() { return {rich_mesh(), fixtures::torus(20, 12), fixtures::repaired(Shape::vase, 2000)}; }

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
                if (!mesh.colours.empty()) { EXPECT_EQ(read->colours[w], mesh.colours[w]); }
            }
            EXPECT_EQ(read->images.size(), mesh.images.size());
        }
    }
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

// Ends with 1 where the validator finds errors in one of the files, with 3 where it is not there; its finds are
// printed, and how many files it has seen.
constexpr const char* validator_script =
    "let v; try { v = require('gltf-validator'); } catch (e) { process.exit(3); }"
    "const fs = require('fs'); let errors = 0;"
    "(async () => { const names = fs.readdirSync('.').filter(n => n.endsWith('.glb'));"
    "  for (const n of names) { const r = await v.validateBytes(new Uint8Array(fs.readFileSync(n)));"
    "    for (const m of r.issues.messages) if (m.severity < 2) console.log(n, m.code, m.message, m.pointer);"
    "    errors += r.issues.numErrors; }"
    "  console.log(names.length + ' files'); process.exit(errors > 0 ? 1 : 0); })();";

TEST_F(WriteGlbTest, KhronosValidatorFindsNoErrors) {
    std::ofstream(folder_ / "validate.js") << validator_script;
    const auto validate = [&](std::string& found) {
        const std::string command = "cd '" + folder_.string() +
                                    "' && NODE_PATH=\"${NODE_PATH:-$(npm root -g 2>/dev/null)}\" node validate.js "
                                    "> found.txt 2>/dev/null";
        const int status = std::system(command.c_str());
        std::ifstream file(folder_ / "found.txt");
        found.assign(std::istreambuf_iterator<char>(file), {});
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    };
    int number = 0;
    for (const TriMesh& mesh : meshes()) {
        for (const Encoding encoding : {Encoding::plain, Encoding::quantised, Encoding::meshopt}) {
            for (const int quality : {0, 90}) {
                WriteOptions options;
                options.encoding = encoding;
                options.jpeg_quality = quality;
                ASSERT_TRUE(write_mesh(mesh, folder_ / (std::to_string(number++) + ".glb"), options));
            }
        }
    }
    std::string found;
    const int code = validate(found);
    if (code == 3 || code == 127)
        GTEST_SKIP() << "gltf-validator of npm is not there: npm install -g gltf-validator, or name its folder by "
                        "NODE_PATH";
    EXPECT_EQ(code, 0) << found;
    EXPECT_THAT(found, testing::HasSubstr("18 files"));
    // It does find something where there is something.
    std::fstream file(folder_ / "0.glb", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(8);
    file.write("\0\0\1\0", 4);
    file.close();
    EXPECT_EQ(validate(found), 1);
}

}  // namespace
}  // namespace lodestone
