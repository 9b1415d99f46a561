// The C interface as a program sees it that links the shared library.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "base/files/chunk_file.h"
#include "fixtures/materials.h"
#include "fixtures/written_glbs.h"
#include "lodestone.h"
#include "mesh/generate.h"
#include "mesh/io/write.h"

namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Handles that free themselves.
struct Free {
    void operator()(lodestone_mesh* mesh) const { lodestone_mesh_free(mesh); }
    void operator()(lodestone_asset* asset) const { lodestone_asset_free(asset); }
    void operator()(lodestone_cutter* cutter) const { lodestone_cutter_free(cutter); }
    void operator()(lodestone_cancel* cancel) const { lodestone_cancel_free(cancel); }
};
using Mesh = std::unique_ptr<lodestone_mesh, Free>;
using Asset = std::unique_ptr<lodestone_asset, Free>;
using Cutter = std::unique_ptr<lodestone_cutter, Free>;
using Cancel = std::unique_ptr<lodestone_cancel, Free>;

struct Arrays {
    std::vector<float> positions, uvs;
    std::vector<uint32_t> triangles;
    std::vector<uint8_t> colours;

    lodestone_arrays c() const {
        lodestone_arrays arrays{};
        arrays.struct_size = sizeof arrays;
        arrays.vertex_count = positions.size() / 3;
        arrays.triangle_count = triangles.size() / 3;
        arrays.positions = positions.data();
        arrays.triangles = triangles.data();
        if (!uvs.empty()) arrays.uvs = uvs.data();
        if (!colours.empty()) arrays.colours = colours.data();
        return arrays;
    }
};

uint8_t shade(float coordinate) { return static_cast<uint8_t>(std::lround(127.5f + 120 * coordinate)); }

// A sphere of radius 1 whose colours tell where they are.
Arrays sphere(uint64_t triangles) {
    const lodestone::TriMesh mesh = lodestone::generate(lodestone::Shape::sphere, triangles, 1);
    Arrays arrays;
    for (const glm::vec3& at : mesh.positions) {
        const glm::vec3 p = glm::normalize(at);
        arrays.positions.insert(arrays.positions.end(), {p.x, p.y, p.z});
        arrays.colours.insert(arrays.colours.end(), {shade(p.x), shade(p.y), shade(p.z), 255});
    }
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (int k = 0; k < 3; ++k) arrays.triangles.push_back(mesh.vertex_of(t, k));
    }
    return arrays;
}

Mesh mesh_of(const Arrays& arrays) {
    const lodestone_arrays c = arrays.c();
    lodestone_mesh* mesh = nullptr;
    EXPECT_EQ(lodestone_mesh_create(&c, &mesh), LODESTONE_OK) << lodestone_error();
    return Mesh(mesh);
}

Asset baked(const Arrays& arrays, const char* options) {
    const Mesh mesh = mesh_of(arrays);
    lodestone_asset* asset = nullptr;
    EXPECT_EQ(lodestone_bake(mesh.get(), options, nullptr, nullptr, &asset), LODESTONE_OK) << lodestone_error();
    return Asset(asset);
}

constexpr const char* small_options = "--backends lod,vgi --order static --resolution 33 --clusters 8";
const Arrays& small_sphere() {
    static const Arrays arrays = sphere(3000);
    return arrays;
}
const lodestone_asset* small_asset() {
    static const Asset asset = baked(small_sphere(), small_options);
    return asset.get();
}

lodestone_view view_from(float away) {
    lodestone_view view{};
    view.struct_size = sizeof view;
    view.eye[2] = away;
    view.up[1] = 1;
    view.fov_y = 1;
    view.near_plane = 0.01f;
    view.far_plane = 1000;
    view.width = 800;
    view.height = 600;
    view.pixel_error = 1;
    view.wait = 1;
    return view;
}

Cutter cutter_of(const lodestone_asset* asset, lodestone_backend backend) {
    lodestone_cutter* cutter = nullptr;
    EXPECT_EQ(lodestone_cutter_create(asset, backend, 0, &cutter), LODESTONE_OK) << lodestone_error();
    return Cutter(cutter);
}

lodestone_cut cut_of(lodestone_cutter* cutter, const lodestone_view& view) {
    lodestone_cut cut{};
    cut.struct_size = sizeof cut;
    EXPECT_EQ(lodestone_cutter_cut(cutter, &view, &cut), LODESTONE_OK) << lodestone_error();
    return cut;
}

lodestone_arrays arrays_of(const lodestone_mesh* mesh) {
    lodestone_arrays arrays{};
    arrays.struct_size = sizeof arrays;
    EXPECT_EQ(lodestone_mesh_arrays(mesh, &arrays), LODESTONE_OK);
    return arrays;
}

Mesh extracted(const lodestone_asset* asset, lodestone_backend backend, uint32_t level) {
    lodestone_mesh* mesh = nullptr;
    EXPECT_EQ(lodestone_asset_extract(asset, backend, level, &mesh), LODESTONE_OK) << lodestone_error();
    return Mesh(mesh);
}

std::string output_of(const std::string& command) {
    std::FILE* pipe = popen(command.c_str(), "r");
    std::string out;
    std::array<char, 4096> buffer{};
    for (size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) out.append(buffer.data(), n);
    EXPECT_EQ(pclose(pipe), 0) << command;
    return out;
}

std::string text_of(const std::string& path) {
    std::ifstream in(std::string(LODESTONE_SOURCE_DIR) + "/" + path);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::set<std::string> found(const std::string& text, const std::string& expression) {
    std::set<std::string> names;
    const std::regex pattern(expression);
    for (std::sregex_iterator i(text.begin(), text.end(), pattern), end; i != end; ++i) names.insert((*i)[1]);
    return names;
}

// What the library shows is what the list pins, and what the header declares and documents.
TEST(SharedLibrary, ShowsTheFunctionsOfItsHeaderAndNothingElse) {
    const std::string symbols = output_of(LODESTONE_NM " -D --defined-only " LODESTONE_SHARED_LIBRARY);
    // The version's own symbol is absolute; some linkers give it the version, too.
    const auto shown = found(symbols, "[0-9a-f]+ [B-Zb-z] ([^@ \\n]+)@*LODESTONE_0\\n");
    const auto lines = static_cast<size_t>(std::count(symbols.begin(), symbols.end(), '\n'));
    EXPECT_EQ(lines, shown.size() + 1) << "the version's own symbol is the only other one\n" << symbols;
    EXPECT_EQ(shown, found(text_of("apps/c/liblodestone.map"), "        (\\w+);"));
    const std::string header = text_of("apps/c/lodestone.h");
    EXPECT_EQ(shown, found(header, "\\n[^/ #\\n][^/\\n]*\\b(lodestone_\\w+)\\("));
    for (const std::string& name : shown)
        EXPECT_TRUE(std::regex_search(header, std::regex("//[^\\n]*\\n[^/\\n]*\\b" + name + "\\(")))
            << name << " has no comment";
    EXPECT_GE(shown.size(), 30u);
}

TEST(SharedLibrary, HasASonameAndNeedsNothingThatDraws) {
    const std::string dynamic = output_of(LODESTONE_READELF " -d " LODESTONE_SHARED_LIBRARY);
    const std::string major = std::to_string(std::atoi(LODESTONE_PROJECT_VERSION));
    EXPECT_THAT(dynamic, HasSubstr("[liblodestone.so." + major + "]"));
    for (const char* library : {"vulkan", "glfw", "imgui", "glslang"})
        EXPECT_THAT(dynamic, testing::Not(HasSubstr(library)));
    EXPECT_STREQ(lodestone_version(), LODESTONE_PROJECT_VERSION);
}

TEST(Meshes, AreTheArraysTheyWereMadeOf) {
    const Arrays& given = small_sphere();
    const Mesh mesh = mesh_of(given);
    const lodestone_arrays arrays = arrays_of(mesh.get());
    ASSERT_EQ(arrays.vertex_count, given.positions.size() / 3);
    ASSERT_EQ(arrays.triangle_count, given.triangles.size() / 3);
    EXPECT_EQ(std::memcmp(arrays.positions, given.positions.data(), given.positions.size() * 4), 0);
    EXPECT_EQ(std::memcmp(arrays.triangles, given.triangles.data(), given.triangles.size() * 4), 0);
    EXPECT_EQ(std::memcmp(arrays.colours, given.colours.data(), given.colours.size()), 0);
    EXPECT_EQ(arrays.normals, nullptr);
    EXPECT_EQ(arrays.material_count, 0u);
}

TEST(Meshes, KeepMaterialsAndImagesThroughAFile) {
    Arrays given = small_sphere();
    given.uvs.assign(given.positions.size() / 3 * 2, 0.25f);
    const std::vector<uint8_t> texels(4 * 4 * 4, 200);
    const lodestone_image image{4, 4, texels.data()};
    const lodestone_material material{
        "st\xff"
        "one",
        {0.5f, 0.25f, 1, 1},
        0,
        1};
    const std::vector<uint16_t> materials(given.positions.size() / 3, 0);
    lodestone_arrays c = given.c();
    c.materials = materials.data();
    c.material_table = &material;
    c.material_count = 1;
    c.images = &image;
    c.image_count = 1;
    lodestone_mesh* made = nullptr;
    ASSERT_EQ(lodestone_mesh_create(&c, &made), LODESTONE_OK) << lodestone_error();
    const Mesh mesh(made);
    const fs::path path = fs::temp_directory_path() / ("lodestone_c_" + std::to_string(getpid()) + ".glb");
    ASSERT_EQ(lodestone_mesh_write(mesh.get(), path.c_str()), LODESTONE_OK) << lodestone_error();
    lodestone_mesh* read = nullptr;
    ASSERT_EQ(lodestone_mesh_read(path.c_str(), nullptr, &read), LODESTONE_OK) << lodestone_error();
    lodestone::fixtures::WrittenGlbs written;
    written.keep(path);
    written.check();
    fs::remove(path);
    const Mesh again(read);
    const lodestone_arrays arrays = arrays_of(again.get());
    EXPECT_EQ(arrays.triangle_count, c.triangle_count);
    std::vector<lodestone_material> textured;
    for (uint32_t m = 0; m < arrays.material_count; ++m) {
        if (arrays.material_table[m].image >= 0) textured.push_back(arrays.material_table[m]);
    }
    ASSERT_EQ(textured.size(), 1u);
    EXPECT_NEAR(textured[0].base_colour[1], 0.25f, 1e-6);
    ASSERT_EQ(arrays.image_count, 1u);
    EXPECT_EQ(arrays.images[0].width, 4u);
    EXPECT_EQ(arrays.images[0].rgba[0], 200);
    lodestone_asset* asset = nullptr;
    ASSERT_EQ(lodestone_bake(mesh.get(), small_options, nullptr, nullptr, &asset), LODESTONE_OK) << lodestone_error();
    const Asset owned(asset);
    lodestone_arrays looks{};
    looks.struct_size = sizeof looks;
    ASSERT_EQ(lodestone_asset_materials(asset, &looks), LODESTONE_OK);
    EXPECT_EQ(looks.image_count, 1u);
    EXPECT_THAT(looks.material_table[0].name, HasSubstr("one"));
}

using Refusal = std::pair<std::function<void(lodestone_arrays&)>, std::string>;

TEST(Meshes, OfHostileArraysAreRefusedByName) {
    const std::vector<uint16_t> materials(3, 7);
    const std::array<float, 9> holes{0, 0, 0, 1, std::numeric_limits<float>::quiet_NaN(), 0, 0, 1, 0},
        endless{0, 0, 0, 1, 0, 0, 0, std::numeric_limits<float>::infinity(), 0};
    const std::array<uint32_t, 3> outside{0, 1, 3};
    const lodestone_material dark{nullptr, {-1, 0, 0, 1}, -1, 0}, lost{nullptr, {1, 1, 1, 1}, 5, 0};
    const lodestone_image none{1, 1, nullptr},
        flat{0, 1, materials.empty() ? nullptr : reinterpret_cast<const uint8_t*>(&dark)},
        endless_image{0xffffffff, 0xffffffff, reinterpret_cast<const uint8_t*>(&dark)};
    const std::vector<Refusal> refusals = {
        {[](auto& a) { a.struct_size = 3; }, "struct_size"},
        {[](auto& a) { a.struct_size = ~size_t{0}; }, "struct_size"},
        {[](auto& a) { a.vertex_count = 0; }, "vertex_count"},
        {[](auto& a) { a.vertex_count = ~uint64_t{0}; }, "vertex_count"},
        {[](auto& a) { a.triangle_count = 0; }, "triangle_count"},
        {[](auto& a) { a.triangle_count = uint64_t{1} << 63; }, "triangle_count"},
        {[](auto& a) { a.positions = nullptr; }, "positions"},
        {[](auto& a) { a.triangles = nullptr; }, "triangles"},
        {[&](auto& a) { a.positions = holes.data(); }, "positions: that of vertex 1 is not finite"},
        {[&](auto& a) { a.normals = endless.data(); }, "normals: that of vertex 2 is not finite"},
        {[&](auto& a) { a.uvs = holes.data() + 3; }, "uvs: that of vertex 0 is not finite"},
        {[&](auto& a) { a.triangles = outside.data(); }, "triangle 0 refers to vertex 3"},
        {[&](auto& a) { a.materials = materials.data(); }, "vertex 0 has material 7"},
        {[](auto& a) { a.material_count = 1; }, "material_table is NULL"},
        {[](auto& a) { a.material_count = 1 << 20; }, "material_count"},
        {[&](auto& a) { a.material_count = 1, a.material_table = &dark; }, "base colour of material 0"},
        {[&](auto& a) { a.material_count = 1, a.material_table = &lost; }, "refers to image 5"},
        {[](auto& a) { a.image_count = 1; }, "images is NULL"},
        {[&](auto& a) { a.image_count = 1, a.images = &none; }, "rgba is NULL"},
        {[&](auto& a) { a.image_count = 1, a.images = &flat; }, "a side is not"},
        {[&](auto& a) { a.image_count = 1, a.images = &endless_image; }, "a side is not"}};
    const Arrays triangle{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {}, {0, 1, 2}, {}};
    for (const auto& [spoil, said] : refusals) {
        lodestone_arrays arrays = triangle.c();
        spoil(arrays);
        auto* mesh = reinterpret_cast<lodestone_mesh*>(&arrays);
        EXPECT_EQ(lodestone_mesh_create(&arrays, &mesh), LODESTONE_USAGE) << said;
        EXPECT_EQ(mesh, nullptr) << said;
        EXPECT_THAT(lodestone_error(), HasSubstr(said));
    }
}

// Whatever the arrays hold, a bake ends with an asset that verifies or with one line.
TEST(Meshes, OfAnySoupBakeOrSayWhyNot) {
    std::mt19937 random(7);
    const auto number = [&](uint32_t below) { return static_cast<uint32_t>(random() % below); };
    std::vector<Arrays> soups = {{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {}, {0, 1, 2}, {}},
                                 {{0, 0, 0}, {}, {0, 0, 0}, {}},
                                 {{1, 1, 1, 1, 1, 1, 1, 1, 1}, {}, {0, 1, 2}, {}},
                                 {{0, 0, 0, 1e-40f, 0, 0, 0, 1e-40f, 0}, {}, {0, 1, 2, 2, 1, 0}, {}},
                                 {{-3e38f, 0, 0, 3e38f, 0, 0, 0, 3e38f, 0}, {}, {0, 1, 2}, {}}};
    for (const uint32_t vertices : {4u, 12u}) {
        Arrays soup;
        for (uint32_t i = 0; i < 3 * vertices; ++i)
            soup.positions.push_back(static_cast<float>(static_cast<int>(number(9)) - 4) *
                                     (number(2) != 0 ? 1 : 1e18f));
        for (uint32_t i = 0; i < 6 * vertices; ++i) soup.triangles.push_back(number(vertices));
        soups.push_back(soup);
    }
    size_t baked = 0;
    for (const Arrays& soup : soups) {
        const Mesh mesh = mesh_of(soup);
        ASSERT_NE(mesh, nullptr);
        for (const char* options : {"--backends lod --order static", "--backends vgi --resolution 5 --clusters 2"}) {
            lodestone_asset* asset = nullptr;
            const lodestone_status status = lodestone_bake(mesh.get(), options, nullptr, nullptr, &asset);
            const Asset owned(asset);
            if (status != LODESTONE_OK) {
                EXPECT_EQ(asset, nullptr);
                EXPECT_STRNE(lodestone_error(), "");
                continue;
            }
            ++baked;
            EXPECT_EQ(lodestone_asset_verify(asset), LODESTONE_OK) << lodestone_error();
            for (const lodestone_backend backend : {LODESTONE_LOD, LODESTONE_VGI}) {
                lodestone_cutter* cutter = nullptr;
                if (lodestone_cutter_create(asset, backend, 0, &cutter) != LODESTONE_OK) continue;
                cut_of(Cutter(cutter).get(), view_from(3));
            }
        }
    }
    EXPECT_GE(baked, 5u);
}

TEST(Arguments, ThatAreNullAreRefused) {
    lodestone_mesh* mesh = nullptr;
    lodestone_asset* asset = nullptr;
    lodestone_cutter* cutter = nullptr;
    const Mesh sphere_mesh = mesh_of(small_sphere());
    const Cutter good = cutter_of(small_asset(), LODESTONE_LOD);
    const lodestone_arrays arrays = small_sphere().c();
    const lodestone_view view = view_from(3);
    lodestone_cut cut{};
    cut.struct_size = sizeof cut;
    lodestone_target target{};
    target.struct_size = sizeof target;
    target.triangles = 10;
    uint32_t level = 0;
    float numbers[3];
    const std::array<lodestone_status, 35> refused = {
        lodestone_mesh_create(nullptr, &mesh),
        lodestone_mesh_create(&arrays, nullptr),
        lodestone_mesh_read(nullptr, nullptr, &mesh),
        lodestone_mesh_read("a.ply", nullptr, nullptr),
        lodestone_mesh_write(nullptr, "a.ply"),
        lodestone_mesh_write(sphere_mesh.get(), nullptr),
        lodestone_mesh_arrays(nullptr, nullptr),
        lodestone_mesh_arrays(sphere_mesh.get(), nullptr),
        lodestone_simplify(nullptr, &target, nullptr, &mesh),
        lodestone_simplify(sphere_mesh.get(), nullptr, nullptr, &mesh),
        lodestone_simplify(sphere_mesh.get(), &target, nullptr, nullptr),
        lodestone_unwrap(nullptr, nullptr, nullptr, &mesh, nullptr),
        lodestone_unwrap(sphere_mesh.get(), nullptr, nullptr, nullptr, nullptr),
        lodestone_simulate_cache(nullptr, 3, nullptr, nullptr),
        lodestone_simulate_cache(nullptr, 0, nullptr, nullptr),
        lodestone_bake(nullptr, nullptr, nullptr, nullptr, &asset),
        lodestone_bake(sphere_mesh.get(), nullptr, nullptr, nullptr, nullptr),
        lodestone_asset_open(nullptr, &asset),
        lodestone_asset_open("a.lode", nullptr),
        lodestone_asset_open_memory(nullptr, 5, &asset),
        lodestone_asset_open_memory("a", 1, nullptr),
        lodestone_asset_verify(nullptr),
        lodestone_asset_bounds(nullptr, numbers, numbers),
        lodestone_asset_bounds(small_asset(), nullptr, numbers),
        lodestone_asset_materials(nullptr, nullptr),
        lodestone_asset_level_count(nullptr, LODESTONE_LOD, &level),
        lodestone_asset_level_count(small_asset(), LODESTONE_LOD, nullptr),
        lodestone_asset_level(nullptr, LODESTONE_LOD, 0, nullptr, nullptr),
        lodestone_asset_level_for_triangles(small_asset(), LODESTONE_LOD, 5, nullptr),
        lodestone_asset_level_for_error(small_asset(), LODESTONE_LOD, 5, nullptr),
        lodestone_asset_extract(small_asset(), LODESTONE_LOD, 0, nullptr),
        lodestone_cutter_create(nullptr, LODESTONE_LOD, 0, &cutter),
        lodestone_cutter_create(small_asset(), LODESTONE_LOD, 0, nullptr),
        lodestone_cutter_cut(nullptr, &view, &cut),
        lodestone_cutter_cut(good.get(), nullptr, &cut)};
    EXPECT_THAT(refused, testing::Each(LODESTONE_USAGE));
    EXPECT_EQ(lodestone_cutter_cut(good.get(), &view, nullptr), LODESTONE_USAGE);
    EXPECT_EQ(lodestone_asset_about(nullptr), nullptr);
    lodestone_mesh_free(nullptr);
    lodestone_asset_free(nullptr);
    lodestone_cutter_free(nullptr);
    lodestone_cancel_set(nullptr);
    lodestone_cancel_free(nullptr);
}

TEST(Arguments, ThatMakeNoSenseAreRefusedByName) {
    const auto refused = [](lodestone_status status, const std::string& said) {
        EXPECT_EQ(status, LODESTONE_USAGE) << said;
        EXPECT_THAT(lodestone_error(), HasSubstr(said));
    };
    const Mesh mesh = mesh_of(small_sphere());
    lodestone_mesh* made = nullptr;
    lodestone_asset* asset = nullptr;
    lodestone_cutter* cutter = nullptr;
    uint32_t level = 0;
    refused(lodestone_bake(mesh.get(), "--resolution 66", nullptr, nullptr, &asset), "66");
    refused(lodestone_bake(mesh.get(), "--backends nanite", nullptr, nullptr, &asset), "nanite");
    refused(lodestone_bake(mesh.get(), "--help", nullptr, nullptr, &asset), "--help");
    refused(lodestone_bake(mesh.get(), "--order \"", nullptr, nullptr, &asset), "");
    refused(lodestone_asset_extract(small_asset(), 5, 0, &made), "backend must be");
    refused(lodestone_asset_extract(small_asset(), -1, 0, &made), "backend must be");
    refused(lodestone_asset_extract(small_asset(), LODESTONE_LOD, 1 << 30, &made), "the asset has levels 0");
    refused(lodestone_asset_level(small_asset(), LODESTONE_VGI, 99, nullptr, nullptr), "the asset has levels 0");
    refused(lodestone_asset_level_for_error(small_asset(), LODESTONE_VGI, std::nan(""), &level), "0 or more");
    refused(lodestone_cutter_create(small_asset(), LODESTONE_VGI, ~uint64_t{0}, &cutter), "resident_bytes");
    refused(lodestone_set_threads(1 << 30), "threads");
    lodestone_target target{};
    target.struct_size = sizeof target;
    refused(lodestone_simplify(mesh.get(), &target, nullptr, &made), "either a number of triangles or an error");
    target.error = std::nan("");
    refused(lodestone_simplify(mesh.get(), &target, nullptr, &made), "the error must be");
    const lodestone_progress unsized{};
    target.error = 1;
    refused(lodestone_simplify(mesh.get(), &target, &unsized, &made), "struct_size");
    refused(lodestone_unwrap(mesh.get(), "--resolution 5", nullptr, &made, nullptr), "resolution");
    refused(lodestone_unwrap(mesh.get(), "--out a.glb", nullptr, &made, nullptr), "--out");
    refused(lodestone_unwrap(mesh.get(), "--resolution 16 --gutter 16", nullptr, &made, nullptr), "leave no room");
    lodestone_unwrap_report unwrap_report{};
    refused(lodestone_unwrap(mesh.get(), nullptr, nullptr, &made, &unwrap_report), "struct_size");
    refused(lodestone_unwrap(mesh.get(), nullptr, &unsized, &made, nullptr), "struct_size");
    EXPECT_EQ(made, nullptr);
    lodestone_cache_cost cost{};
    cost.struct_size = sizeof cost;
    const uint32_t three[] = {0, 1, 2};
    refused(lodestone_simulate_cache(three, 2, nullptr, &cost), "multiple of 3");
    refused(lodestone_simulate_cache(three, 3, "none", &cost), "none");
    EXPECT_EQ(lodestone_cutter_create(small_asset(), LODESTONE_VGI, 1000, &cutter), LODESTONE_MACHINE);
    EXPECT_THAT(lodestone_error(), HasSubstr("raise the budget"));
    EXPECT_EQ(lodestone_mesh_read("/no/such.ply", nullptr, &made), LODESTONE_FORMAT);
    EXPECT_THAT(lodestone_error(), HasSubstr("/no/such.ply"));
    EXPECT_EQ(lodestone_mesh_write(mesh.get(), "a.stl"), LODESTONE_USAGE);
}

TEST(Arguments, OfViewsAreChecked) {
    const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
    const std::vector<std::pair<std::function<void(lodestone_view&)>, std::string>> refusals = {
        {[](auto& v) { v.struct_size = 1; }, "struct_size"},
        {[&](auto& v) { v.eye[1] = nan; }, "eye"},
        {[&](auto& v) { v.target[0] = inf; }, "target"},
        {[&](auto& v) { v.eye[2] = 0; }, "one point"},
        {[](auto& v) { v.up[1] = 0; }, "up has no length"},
        {[](auto& v) { v.fov_y = 0; }, "fov_y"},
        {[&](auto& v) { v.fov_y = nan; }, "fov_y"},
        {[](auto& v) { v.near_plane = 0; }, "near_plane"},
        {[](auto& v) { v.far_plane = v.near_plane; }, "near_plane"},
        {[&](auto& v) { v.far_plane = inf; }, "near_plane"},
        {[](auto& v) { v.width = 0; }, "width"},
        {[](auto& v) { v.height = 1 << 20; }, "width"},
        {[](auto& v) { v.pixel_error = 0; }, "pixel_error"},
        {[&](auto& v) { v.pixel_error = std::nan(""); }, "pixel_error"},
        {[&](auto& v) { v.object_to_world[0] = nan; }, "not finite"},
        {[](auto& v) { v.object_to_world[0] = 1; }, "not affine"},
        {[](auto& v) { v.object_to_world[0] = v.object_to_world[15] = 1; }, "flattens"}};
    for (const lodestone_backend backend : {LODESTONE_LOD, LODESTONE_VGI}) {
        const Cutter cutter = cutter_of(small_asset(), backend);
        for (const auto& [spoil, said] : refusals) {
            lodestone_view view = view_from(3);
            spoil(view);
            lodestone_cut cut{};
            cut.struct_size = sizeof cut;
            EXPECT_EQ(lodestone_cutter_cut(cutter.get(), &view, &cut), LODESTONE_USAGE) << said;
            EXPECT_THAT(lodestone_error(), HasSubstr(said));
        }
        EXPECT_GT(cut_of(cutter.get(), view_from(3)).index_count, 0u) << "a refused view harms nothing";
        for (const float away : {1e-6f, 1e6f, 1e14f}) cut_of(cutter.get(), view_from(away));
        lodestone_view elsewhere = view_from(3);
        elsewhere.target[2] = 10;
        EXPECT_EQ(cut_of(cutter.get(), elsewhere).index_count, 0u) << "what is behind the eye is not drawn";
    }
}

TEST(Bakes, AreCancelledByTheirCallerAndByOtherThreads) {
    const Mesh mesh = mesh_of(sphere(40000));
    lodestone_asset* asset = nullptr;
    lodestone_progress progress{};
    progress.struct_size = sizeof progress;
    int calls = 0;
    progress.user = &calls;
    progress.report = [](void* user, const char* stage, double fraction) {
        EXPECT_GT(std::strlen(stage), 0u);
        EXPECT_TRUE(fraction >= 0 && fraction <= 1) << fraction;
        return ++*static_cast<int*>(user) == 3 ? 1 : 0;
    };
    EXPECT_EQ(lodestone_bake(mesh.get(), nullptr, &progress, nullptr, &asset), LODESTONE_INTERRUPTED);
    EXPECT_GE(calls, 3);
    EXPECT_EQ(asset, nullptr);

    const Cancel cancel(lodestone_cancel_create());
    progress.report = nullptr;
    progress.cancel = cancel.get();
    std::thread other([&] { lodestone_cancel_set(cancel.get()); });
    EXPECT_EQ(lodestone_bake(mesh.get(), "--backends lod,vgi", &progress, nullptr, &asset), LODESTONE_INTERRUPTED);
    other.join();
    lodestone_target target{};
    target.struct_size = sizeof target;
    target.triangles = 100;
    lodestone_mesh* simplified = nullptr;
    EXPECT_EQ(lodestone_simplify(mesh.get(), &target, &progress, &simplified), LODESTONE_INTERRUPTED);
    EXPECT_EQ(lodestone_unwrap(mesh.get(), nullptr, &progress, &simplified, nullptr), LODESTONE_INTERRUPTED);
}

// What the header of an asset says that it was made from.
std::string source_of(const lodestone::TriMesh& mesh) {
    const fs::path folder = fs::temp_directory_path() / ("lodestone_c_key_" + std::to_string(getpid()));
    fs::create_directories(folder);
    EXPECT_TRUE(lodestone::write_mesh(mesh, folder / "a.glb"));
    lodestone_mesh* read = nullptr;
    EXPECT_EQ(lodestone_mesh_read((folder / "a.glb").c_str(), nullptr, &read), LODESTONE_OK) << lodestone_error();
    const Mesh made(read);
    const std::string asset = folder / "a.lode";
    EXPECT_EQ(lodestone_bake(made.get(), "--backends full", nullptr, asset.c_str(), nullptr), LODESTONE_OK)
        << lodestone_error();
    const auto file = lodestone::ChunkFile::open(asset);
    EXPECT_TRUE(file);
    fs::remove_all(folder);
    return file ? file->provenance().source.hex() : "";
}

TEST(Bakes, AreKeyedByAllOfAMaterial) {
    const lodestone::TriMesh mesh = lodestone::fixtures::mesh_of_every_material();
    std::set<std::string> sources{source_of(mesh)};
    EXPECT_EQ(sources, std::set{source_of(mesh)});
    const std::vector<std::function<void(lodestone::Material&)>> changes = {
        [](auto& m) { m.base_colour.z = 0; },
        [](auto& m) { m.shading = lodestone::Shading::unlit; },
        [](auto& m) { m.alpha_mode = lodestone::AlphaMode::blend; },
        [](auto& m) { m.alpha_cutoff = 0.75f; },
        [](auto& m) { m.metallic = 0; },
        [](auto& m) { m.roughness = 0; },
        [](auto& m) { m.normal_scale = 0; },
        [](auto& m) { m.occlusion_strength = 0; },
        [](auto& m) { m.emission.x = 1; },
        [](auto& m) { m.emission_texture.image = 0; },
        [](auto& m) { m.normal_texture.wrap[1] = lodestone::Wrap::mirror; },
        [](auto& m) { m.occlusion_texture.place[2].y = 9; }};
    for (const auto& change : changes) {
        lodestone::TriMesh other = mesh;
        change(other.material_table[1]);
        sources.insert(source_of(other));
    }
    EXPECT_EQ(sources.size(), changes.size() + 1);
}

TEST(Bakes, GiveTheSameAssetToAFileAndToMemory) {
    const fs::path path = fs::temp_directory_path() / ("lodestone_c_" + std::to_string(getpid()) + ".lode");
    const Mesh mesh = mesh_of(small_sphere());
    ASSERT_EQ(lodestone_bake(mesh.get(), small_options, nullptr, path.c_str(), nullptr), LODESTONE_OK)
        << lodestone_error();
    lodestone_asset *from_file = nullptr, *from_memory = nullptr;
    ASSERT_EQ(lodestone_asset_open(path.c_str(), &from_file), LODESTONE_OK) << lodestone_error();
    const Asset file(from_file);
    std::ifstream in(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(in), {}};
    fs::remove(path);
    ASSERT_EQ(lodestone_asset_open_memory(bytes.data(), bytes.size(), &from_memory), LODESTONE_OK) << lodestone_error();
    const Asset memory(from_memory);
    EXPECT_STREQ(lodestone_asset_about(file.get()), lodestone_asset_about(memory.get()));
    EXPECT_STREQ(lodestone_asset_about(file.get()), lodestone_asset_about(small_asset()));
    for (const lodestone_asset* asset : {file.get(), memory.get()}) {
        EXPECT_EQ(lodestone_asset_verify(asset), LODESTONE_OK) << lodestone_error();
        const Cutter cutter = cutter_of(asset, LODESTONE_VGI), other = cutter_of(small_asset(), LODESTONE_VGI);
        const lodestone_cut a = cut_of(cutter.get(), view_from(3)), b = cut_of(other.get(), view_from(3));
        ASSERT_EQ(a.index_count, b.index_count);
        EXPECT_EQ(a.vertex_count, b.vertex_count);
    }
    lodestone_asset* damaged = nullptr;
    EXPECT_EQ(lodestone_asset_open_memory(bytes.data(), bytes.size() / 2, &damaged), LODESTONE_FORMAT);
    EXPECT_EQ(lodestone_asset_open_memory("", 0, &damaged), LODESTONE_FORMAT);
    bytes[40] ^= 1;
    EXPECT_EQ(lodestone_asset_open_memory(bytes.data(), bytes.size(), &damaged), LODESTONE_FORMAT);
    EXPECT_THAT(lodestone_error(), HasSubstr("asset in memory: "));
    EXPECT_EQ(damaged, nullptr);
}

TEST(Levels, FallInTrianglesAndRiseInError) {
    for (const lodestone_backend backend : {LODESTONE_LOD, LODESTONE_VGI}) {
        uint32_t levels = 0;
        ASSERT_EQ(lodestone_asset_level_count(small_asset(), backend, &levels), LODESTONE_OK);
        ASSERT_GT(levels, 3u);
        uint64_t last_triangles = ~uint64_t{0};
        double last_error = -1;
        for (uint32_t level = 0; level < levels; level += 1 + level / 8) {
            uint64_t triangles = 0;
            double error = 0;
            ASSERT_EQ(lodestone_asset_level(small_asset(), backend, level, &triangles, &error), LODESTONE_OK);
            // An atlas may be sampled more densely than its source.
            if (backend == LODESTONE_LOD || level != 1) { EXPECT_LE(triangles, last_triangles); }
            EXPECT_GE(error, last_error);
            last_triangles = triangles;
            last_error = error;
            uint32_t found = 0;
            ASSERT_EQ(lodestone_asset_level_for_triangles(small_asset(), backend, triangles, &found), LODESTONE_OK);
            EXPECT_LE(found, level);
            ASSERT_EQ(lodestone_asset_level_for_error(small_asset(), backend, error, &found), LODESTONE_OK);
            // The source is better, where it has fewer triangles.
            if (backend == LODESTONE_LOD || found != 0) { EXPECT_GE(found, level); }
        }
    }
    const Asset lod = baked(small_sphere(), "--backends lod --order classic");
    uint32_t levels = 7;
    EXPECT_EQ(lodestone_asset_level_count(lod.get(), LODESTONE_VGI, &levels), LODESTONE_OK);
    EXPECT_EQ(levels, 0u);
    EXPECT_EQ(lodestone_asset_level(lod.get(), LODESTONE_VGI, 0, nullptr, nullptr), LODESTONE_FORMAT);
    EXPECT_THAT(lodestone_error(), HasSubstr("--backends vgi"));
}

TEST(Simplify, ComesUnderTheTriangleCountAndTheError) {
    const Mesh mesh = mesh_of(small_sphere());
    for (const uint32_t openmesh : {0u, 1u}) {
        lodestone_target target{};
        target.struct_size = sizeof target;
        target.triangles = 300;
        target.openmesh = openmesh;
        lodestone_mesh* made = nullptr;
        ASSERT_EQ(lodestone_simplify(mesh.get(), &target, nullptr, &made), LODESTONE_OK) << lodestone_error();
        const Mesh simplified(made);
        EXPECT_LE(arrays_of(made).triangle_count, 300u);
        EXPECT_GE(arrays_of(made).triangle_count, 296u);
        target.triangles = 0;
        target.error = 0.02;
        ASSERT_EQ(lodestone_simplify(mesh.get(), &target, nullptr, &made), LODESTONE_OK) << lodestone_error();
        const Mesh within(made);
        const lodestone_arrays arrays = arrays_of(made);
        EXPECT_LT(arrays.triangle_count, 1500u);
        for (uint64_t t = 0; t < arrays.triangle_count; ++t) {
            glm::vec3 middle(0);
            for (int k = 0; k < 3; ++k) {
                const float* p = arrays.positions + 3 * uint64_t{arrays.triangles[3 * t + static_cast<uint64_t>(k)]};
                middle += glm::vec3(p[0], p[1], p[2]) / 3.0f;
            }
            EXPECT_GT(glm::length(middle), 1 - 0.025f);
        }
    }
}

// The sum of what triangles cover of their squares; each is turned the same way.
double covered(const lodestone_arrays& arrays) {
    double twice = 0;
    for (uint64_t t = 0; t < arrays.triangle_count; ++t) {
        std::array<std::array<double, 2>, 3> at{};
        for (size_t k = 0; k < 3; ++k) {
            for (size_t i = 0; i < 2; ++i) {
                at[k][i] = double{arrays.uvs[2 * uint64_t{arrays.triangles[3 * t + k]} + i]};
                EXPECT_TRUE(at[k][i] >= 0 && at[k][i] <= 1) << at[k][i];
            }
        }
        const double turn =
            (at[1][0] - at[0][0]) * (at[2][1] - at[0][1]) - (at[1][1] - at[0][1]) * (at[2][0] - at[0][0]);
        // Images have their origin at the top, so that what is seen from outside runs clockwise in their numbers.
        EXPECT_LT(turn, 0) << t;
        twice -= turn;
    }
    return twice / 2;
}

TEST(Unwrap, LaysTheSurfaceIntoASquare) {
    const Mesh mesh = mesh_of(small_sphere());
    lodestone_unwrap_report report{};
    report.struct_size = sizeof report;
    lodestone_mesh* made = nullptr;
    ASSERT_EQ(lodestone_unwrap(mesh.get(), "--resolution 512 --charts 12", nullptr, &made, &report), LODESTONE_OK)
        << lodestone_error();
    const Mesh unwrapped(made);
    const lodestone_arrays arrays = arrays_of(made);
    EXPECT_GE(report.charts, 6u);
    EXPECT_LE(report.charts, 40u);
    EXPECT_EQ(report.source_triangles, small_sphere().triangles.size() / 3);
    EXPECT_EQ(report.triangles, arrays.triangle_count);
    EXPECT_GT(report.seam_edges, 0u);
    EXPECT_GT(report.seam_length, 0);
    EXPECT_GE(report.stretch_rms, 1);
    EXPECT_GE(report.stretch_worst, report.stretch_rms * 0.9);
    EXPECT_GT(report.coverage, 0.6);
    ASSERT_NE(arrays.uvs, nullptr);
    ASSERT_NE(arrays.colours, nullptr) << "colours of vertices stay";
    EXPECT_NEAR(covered(arrays), report.coverage, 1e-4);
    EXPECT_EQ(arrays.image_count, 0u);
}

TEST(Unwrap, BringsTexturesOver) {
    Arrays given = small_sphere();
    for (size_t v = 0; v < given.positions.size(); v += 3) {
        given.uvs.push_back(given.positions[v] / 4 + 0.5f);
        given.uvs.push_back(given.positions[v + 1] / 4 + 0.5f);
    }
    given.colours.clear();
    // Left is red, right is blue.
    const std::array<uint8_t, 8> texels{255, 0, 0, 255, 0, 0, 255, 255};
    const lodestone_image image{2, 1, texels.data()};
    const lodestone_material material{"old", {1, 1, 1, 1}, 0, 0};
    lodestone_arrays c = given.c();
    c.material_table = &material;
    c.images = &image;
    c.material_count = c.image_count = 1;
    lodestone_mesh* made = nullptr;
    ASSERT_EQ(lodestone_mesh_create(&c, &made), LODESTONE_OK) << lodestone_error();
    const Mesh mesh(made);
    ASSERT_EQ(lodestone_unwrap(mesh.get(), "--bake --resolution 256", nullptr, &made, nullptr), LODESTONE_OK)
        << lodestone_error();
    const Mesh unwrapped(made);
    const lodestone_arrays arrays = arrays_of(made);
    ASSERT_EQ(arrays.image_count, 1u);
    EXPECT_EQ(arrays.images[0].width, 256u);
    EXPECT_EQ(arrays.images[0].height, 256u);
    size_t seen = 0;
    for (uint64_t v = 0; v < arrays.vertex_count; ++v) {
        const float x = arrays.positions[3 * v];
        if (std::abs(x) < 0.8f) continue;  // elsewhere the two colours run into each other
        const auto texel = [](float at) { return std::min<uint64_t>(static_cast<uint64_t>(at * 256), 255); };
        const uint8_t* colour =
            arrays.images[0].rgba + 4 * (texel(arrays.uvs[2 * v + 1]) * 256 + texel(arrays.uvs[2 * v]));
        EXPECT_GT(colour[x < 0 ? 0 : 2], colour[x < 0 ? 2 : 0] + 60) << x;
        ++seen;
    }
    EXPECT_GT(seen, 100u);
    // Without --bake the old textures would be wrong, and the caller is told so.
    std::vector<std::string> warnings;
    lodestone_progress progress{};
    progress.struct_size = sizeof progress;
    progress.user = &warnings;
    progress.warn = [](void* user, const char* line) {
        static_cast<std::vector<std::string>*>(user)->emplace_back(line);
    };
    ASSERT_EQ(lodestone_unwrap(mesh.get(), nullptr, &progress, &made, nullptr), LODESTONE_OK) << lodestone_error();
    const Mesh bare(made);
    EXPECT_EQ(arrays_of(made).image_count, 0u);
    EXPECT_THAT(warnings, testing::ElementsAre(HasSubstr("left out")));
}

TEST(Cache, CostsWhatTheOrderCosts) {
    lodestone_cache_cost cost{};
    cost.struct_size = sizeof cost;
    const uint32_t strip[] = {0, 1, 2, 2, 1, 3}, far[] = {0, 0xffffffff, 7, 7, 0xffffffff, 0xfffffffe};
    for (const uint32_t* indices : {strip, far}) {
        ASSERT_EQ(lodestone_simulate_cache(indices, 6, "fifo16", &cost), LODESTONE_OK) << lodestone_error();
        EXPECT_EQ(cost.transforms, 4u);
        EXPECT_EQ(cost.triangles, 2u);
        EXPECT_DOUBLE_EQ(cost.acmr, 2);
        EXPECT_DOUBLE_EQ(cost.atvr, 1);
    }
    ASSERT_EQ(lodestone_simulate_cache(nullptr, 0, nullptr, &cost), LODESTONE_OK);
    EXPECT_EQ(cost.transforms, 0u);
}

TEST(Cuts, OfAProgressiveMeshAreItsLevels) {
    const Cutter cutter = cutter_of(small_asset(), LODESTONE_LOD);
    uint64_t version = 0, last = 0;
    for (const float away : {100.0f, 20.0f, 6.0f, 3.0f}) {
        const lodestone_cut cut = cut_of(cutter.get(), view_from(away));
        ASSERT_GE(cut.level, 0);
        EXPECT_EQ(cut.settled, 1u);
        EXPECT_GT(cut.index_count, last) << "nearer is finer";
        last = cut.index_count;
        EXPECT_TRUE(version == 0 || version == cut.vertices_version);
        version = cut.vertices_version;
        const Mesh level = extracted(small_asset(), LODESTONE_LOD, static_cast<uint32_t>(cut.level));
        const lodestone_arrays arrays = arrays_of(level.get());
        ASSERT_EQ(cut.index_count, arrays.triangle_count * 3);
        for (uint64_t i = 0; i < cut.index_count; ++i) {
            const float *a = cut.vertices[cut.indices[i]].position,
                        *b = arrays.positions + 3 * uint64_t{arrays.triangles[i]};
            ASSERT_EQ(std::memcmp(a, b, 12), 0) << i;
        }
        double error = 0;
        lodestone_asset_level(small_asset(), LODESTONE_LOD, static_cast<uint32_t>(cut.level), nullptr, &error);
        EXPECT_LE(error / (static_cast<double>(away) - 1) * 300 / std::tan(0.5), 1.0 + 1e-6) << "of a pixel";
    }
    EXPECT_EQ(cut_of(cutter.get(),
                     [] {
                         lodestone_view away = view_from(3);
                         away.target[2] = 10;
                         return away;
                     }())
                  .index_count,
              0u)
        << "what is behind the eye is not drawn";
}

// Every directed edge of positions has its opposite: a closed surface, whatever vertices are shared.
bool is_closed(const lodestone_cut& cut) {
    std::multiset<std::array<float, 6>> edges;
    for (uint64_t t = 0; t < cut.index_count; t += 3) {
        for (uint64_t k = 0; k < 3; ++k) {
            const float *a = cut.vertices[cut.indices[t + k]].position,
                        *b = cut.vertices[cut.indices[t + (k + 1) % 3]].position;
            const std::array<float, 6> edge{a[0], a[1], a[2], b[0], b[1], b[2]},
                back{b[0], b[1], b[2], a[0], a[1], a[2]};
            if (edge == back) continue;
            const auto other = edges.find(back);
            if (other == edges.end()) {
                edges.insert(edge);
            } else {
                edges.erase(other);
            }
        }
    }
    return edges.empty();
}

TEST(Cuts, OfAnAtlasAreClosedAndCarryTheLookOfTheirPlaces) {
    const Cutter cutter = cutter_of(small_asset(), LODESTONE_VGI);
    uint64_t last = 0;
    for (const float away : {100.0f, 20.0f, 5.0f}) {
        const lodestone_cut cut = cut_of(cutter.get(), view_from(away));
        EXPECT_EQ(cut.settled, 1u);
        EXPECT_EQ(cut.level, -1);
        EXPECT_GT(cut.index_count, last) << "nearer is finer";
        last = cut.index_count;
        EXPECT_TRUE(is_closed(cut)) << away;
        const double pixel = (static_cast<double>(away) + 1) * std::tan(0.5) / 300;
        for (uint64_t v = 0; v < cut.vertex_count; ++v) {
            const lodestone_vertex& vertex = cut.vertices[v];
            const glm::vec3 p(vertex.position[0], vertex.position[1], vertex.position[2]),
                n(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
            ASSERT_NEAR(static_cast<double>(glm::length(p)), 1, 1.5 * pixel + 0.01) << v;
            ASSERT_NEAR(glm::length(n), 1, 1e-3f);
            ASSERT_GT(glm::dot(n, glm::normalize(p)), away < 50 ? 0.9f : 0.5f) << v;
            if (away > 10) continue;
            for (int k = 0; k < 3; ++k) ASSERT_NEAR(vertex.colour[k], shade(p[k]), 24) << v;
        }
    }
    lodestone_view bounded = view_from(5);
    bounded.max_triangles = 100;
    const lodestone_cut cut = cut_of(cutter.get(), bounded);
    EXPECT_LE(cut.index_count, 300u);
    EXPECT_GT(cut.pixel_error, 1.0);
}

TEST(Cuts, FollowTheObject) {
    const Cutter cutter = cutter_of(small_asset(), LODESTONE_VGI), other = cutter_of(small_asset(), LODESTONE_VGI);
    lodestone_view moved = view_from(10);
    const float twice[16] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 0, 0, 1};
    std::memcpy(moved.object_to_world, twice, sizeof twice);
    moved.eye[0] = moved.target[0] = 5;
    EXPECT_EQ(cut_of(cutter.get(), moved).index_count, cut_of(other.get(), view_from(5)).index_count);
}

TEST(Cuts, WithoutWaitingBecomeWhatWaitingGives) {
    const Cutter hasty = cutter_of(small_asset(), LODESTONE_VGI), patient = cutter_of(small_asset(), LODESTONE_VGI);
    lodestone_view view = view_from(3);
    const uint64_t wanted = cut_of(patient.get(), view).index_count;
    view.wait = 0;
    lodestone_cut cut = cut_of(hasty.get(), view);
    EXPECT_GT(cut.index_count, 0u) << "there is something to draw from the first cut on";
    for (int tries = 0; tries < 2000 && (cut.settled == 0 || cut.index_count != wanted); ++tries) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        cut = cut_of(hasty.get(), view);
    }
    EXPECT_EQ(cut.index_count, wanted);
}

TEST(Threads, ShareAnAssetAndHaveErrorsOfTheirOwn) {
    std::vector<std::thread> threads;
    std::array<std::array<uint64_t, 2>, 4> counts{};
    for (size_t i = 0; i < counts.size(); ++i) {
        threads.emplace_back([&counts, i] {
            lodestone_mesh* mesh = nullptr;
            const std::string name = "/no/such" + std::to_string(i) + ".ply";
            EXPECT_EQ(lodestone_mesh_read(name.c_str(), nullptr, &mesh), LODESTONE_FORMAT);
            counts[i] = {cut_of(cutter_of(small_asset(), LODESTONE_VGI).get(), view_from(3)).index_count,
                         arrays_of(extracted(small_asset(), LODESTONE_LOD, 20).get()).triangle_count};
            EXPECT_THAT(lodestone_error(), HasSubstr(name));
        });
    }
    for (std::thread& thread : threads) thread.join();
    for (const auto& count : counts) EXPECT_EQ(count, counts[0]);
}

}  // namespace
