// Draco and meshopt as encoders of others write them, which npm has: equal to the plain file within what the bits that
// they keep lose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <map>

#include "fixtures/materials.h"
#include "fixtures/meshes.h"
#include "fixtures/npm.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

// A ring of two materials, in the one of which everything is: two sets of texture coordinates, tangents, five textures.
TriMesh ring() {
    TriMesh mesh = generate(Shape::torus, 600);
    mesh.material_table = fixtures::every_material();
    mesh.images = fixtures::role_images();
    constexpr uint16_t all = 1, unlit = 2;
    mesh.materials.assign(mesh.wedge_count(), all);
    // Triangles on one side have wedges of their own.
    std::map<uint32_t, uint32_t> own;
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        if (mesh.position_of(t, 0).x < 0) continue;
        for (uint32_t& w : mesh.triangles[t]) {
            const auto [at, is_new] = own.emplace(w, static_cast<uint32_t>(mesh.wedge_count()));
            if (is_new) {
                mesh.wedge_vertex.push_back(mesh.wedge_vertex[w]);
                mesh.normals.push_back(mesh.normals[w]);
                mesh.uvs.push_back(mesh.uvs[w]);
                mesh.materials.push_back(unlit);
            }
            w = at->second;
        }
    }
    for (size_t w = 0; w < mesh.wedge_count(); ++w) {
        const glm::vec3& p = mesh.positions[mesh.wedge_vertex[w]];
        mesh.second_uvs.emplace_back(0.5f * p.x + 0.3f * p.z, 0.2f * p.z - 0.5f * p.y);
        mesh.tangents.push_back(mesh.materials[w] == all ? fixtures::still_life_tangent(mesh.normals[w])
                                                         : glm::vec4(0));
        const glm::vec3 colour = 180.0f + 50.0f * p;
        mesh.colours.emplace_back(glm::u8vec3(colour), uint8_t{255});
    }
    return mesh;
}

// How far apart numbers may be.
struct Loss {
    float position = 0, normal = 0, uv = 0, colour = 0, tangent = 0;
};

// Of an attribute: the most that its numbers differ by, in the direction in which they differ most.
template <class Vector>
float extent_of(const std::vector<Vector>& values) {
    Vector low = values.at(0), high = low;
    for (const Vector& value : values) low = glm::min(low, value), high = glm::max(high, value);
    float most = 0;
    for (int k = 0; k < Vector::length(); ++k) most = std::max(most, high[k] - low[k]);
    return most;
}

// Half a step in every direction, and what floats round. bits: as tests/npm/encode.mjs asks for.
float rounding(float extent, int bits, int directions) {
    return 0.5f * extent / static_cast<float>((1 << bits) - 1) * std::sqrt(static_cast<float>(directions)) + 2e-6f;
}
// The same of unit vectors as points of an octahedron that is folded open, which maps distances to up to three times as
// much; kept as bytes then where an encoder has filtered them.
float octahedral(int bits) { return 3 * rounding(2, bits, 2); }
float signed_bytes() { return rounding(2, 8, 3); }

// A way of encoding, by its name in tests/npm/encode.mjs, and what it may lose. Colours are linear there, of 16 bits.
std::map<std::string, Loss> ways(const TriMesh& mesh) {
    const float extent = extent_of(mesh.positions), first = extent_of(mesh.uvs), second = extent_of(mesh.second_uvs);
    const Loss draco = {rounding(extent, 14, 3), octahedral(10), rounding(std::max(first, second), 12, 2), 0,
                        rounding(2, 12, 3)};
    // What gltfpack scales by has room for both sets.
    std::vector<glm::vec2> uvs = mesh.uvs;
    uvs.insert(uvs.end(), mesh.second_uvs.begin(), mesh.second_uvs.end());
    const Loss packed = {rounding(extent, 14, 3), signed_bytes(), rounding(extent_of(uvs), 12, 2), 0.5f / 255,
                         signed_bytes()};
    // It keeps colours in bytes, whatever it is asked for.
    Loss filtered, packed_filtered = packed, packed_floats;
    packed_floats.colour = packed.colour;
    filtered.normal = filtered.tangent = packed_filtered.normal = packed_filtered.tangent =
        octahedral(8) + signed_bytes();
    return {{"draco-edgebreaker", draco},          {"draco-sequential", draco},        {"meshopt-floats", Loss{}},
            {"meshopt-filtered", filtered},        {"gltfpack-floats", packed_floats}, {"gltfpack-quantised", packed},
            {"gltfpack-filtered", packed_filtered}};
}

glm::vec3 middle_of(const TriMesh& mesh, size_t triangle) {
    return (mesh.position_of(triangle, 0) + mesh.position_of(triangle, 1) + mesh.position_of(triangle, 2)) / 3.0f;
}

// How far the corners of two triangles are apart, where those of the other begin at its corner `first`.
float apart(const TriMesh& mesh, size_t triangle, const TriMesh& other, size_t with, int first) {
    float most = 0;
    for (int k = 0; k < 3; ++k)
        most = std::max(most, glm::distance(mesh.position_of(triangle, k), other.position_of(with, (first + k) % 3)));
    return most;
}

// For each triangle of a mesh the wedges of the one in the other that is nearest, corner by corner.
std::vector<Triangle> matched(const TriMesh& mesh, const TriMesh& other, float allowed) {
    std::vector<Triangle> all;
    std::vector<bool> taken(other.triangle_count());
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        size_t nearest = 0;
        float distance = std::numeric_limits<float>::max();
        for (size_t o = 0; o < other.triangle_count(); ++o) {
            const float d = glm::distance(middle_of(mesh, t), middle_of(other, o));
            if (d < distance) distance = d, nearest = o;
        }
        EXPECT_FALSE(taken[nearest]) << "triangle " << t << " is like one before it";
        taken[nearest] = true;
        int first = 0;
        for (const int k : {1, 2}) {
            if (apart(mesh, t, other, nearest, k) < apart(mesh, t, other, nearest, first)) first = k;
        }
        EXPECT_LE(apart(mesh, t, other, nearest, first), allowed) << "triangle " << t;
        Triangle wedges;
        for (size_t k = 0; k < 3; ++k) wedges[k] = other.triangles[nearest][(static_cast<size_t>(first) + k) % 3];
        all.push_back(wedges);
    }
    return all;
}

// Of sRGB of 8 bits.
glm::vec4 linear(const glm::u8vec4& colour) {
    glm::vec4 of;
    for (int k = 0; k < 4; ++k) {
        const float c = static_cast<float>(colour[k]) / 255;
        of[k] = k == 3 ? c : c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
    }
    return of;
}

const Texture& texture_of(const Material& material, size_t number) {
    return *const_cast<Material&>(material).textures()[number];
}
// Where a texture is looked up for a wedge: an encoder may change coordinates and what places them.
glm::vec2 place_of(const TriMesh& mesh, size_t wedge, const Texture& texture) {
    return texture.place * glm::vec3(texture.second ? mesh.second_uvs[wedge] : mesh.uvs[wedge], 1);
}
// The most that its place makes of a distance.
float growth_of(const Texture& texture) {
    return std::max(glm::length(texture.place[0]), glm::length(texture.place[1]));
}

// The most that any two values differ by, of wedges that match.
struct Found : Loss {
    void add(float& most, float distance) { most = std::max(most, distance); }
    void meet(const TriMesh& a, size_t w, const TriMesh& b, size_t o) {
        const Material &was = a.material_table[a.materials[w]], &is = b.material_table[b.materials[o]];
        EXPECT_EQ(is.name, was.name);
        add(position, glm::distance(a.positions[a.wedge_vertex[w]], b.positions[b.wedge_vertex[o]]));
        add(normal, glm::distance(a.normals[w], b.normals[o]));
        add(uv, glm::distance(a.uvs[w], b.uvs[o]));
        const glm::vec4 differ = glm::abs(linear(a.colours[w]) - linear(b.colours[o]));
        add(colour, std::max({differ.x, differ.y, differ.z, differ.w}));
        for (size_t k = 0; k < texture_names.size(); ++k) {
            const Texture &from = texture_of(was, k), &to = texture_of(is, k);
            if (from.there() && to.there())
                add(uv, glm::distance(place_of(a, w, from), place_of(b, o, to)) / growth_of(from));
        }
        if (!was.normal_texture.there()) return;
        EXPECT_EQ(a.tangents[w].w, b.tangents[o].w);
        add(tangent, glm::distance(glm::vec3(a.tangents[w]), glm::vec3(b.tangents[o])));
    }
};

// Within what may be lost, and, where a lot may, not without any loss: those bits were asked for.
void expect_within(const char* what, float found, float allowed) {
    SCOPED_TRACE(what);
    constexpr float of_floats = 2e-6f;
    EXPECT_LE(found, allowed + of_floats);
    if (allowed > 10 * of_floats) { EXPECT_GT(found, allowed / 50); }
}

void expect_equal(const TriMesh& plain, const TriMesh& other, const Loss& loss) {
    ASSERT_EQ(other.triangle_count(), plain.triangle_count());
    for (const TriMesh* mesh : {&plain, &other}) {
        for (const size_t size : {mesh->normals.size(), mesh->uvs.size(), mesh->second_uvs.size(), mesh->colours.size(),
                                  mesh->tangents.size(), mesh->materials.size()})
            ASSERT_EQ(size, mesh->wedge_count());
    }
    const std::vector<Triangle> wedges = matched(plain, other, loss.position + 2e-6f);
    Found found;
    for (size_t t = 0; t < wedges.size(); ++t) {
        for (size_t k = 0; k < 3; ++k) found.meet(plain, plain.triangles[t][k], other, wedges[t][k]);
    }
    expect_within("positions", found.position, loss.position);
    expect_within("normals", found.normal, loss.normal);
    expect_within("texture coordinates", found.uv, loss.uv);
    expect_within("tangents", found.tangent, loss.tangent);
    // They are read as 8 bits of sRGB, of which a step is up to 2.3 linear ones.
    EXPECT_LE(found.colour, loss.colour + (loss.colour > 0 ? 2.3f / 255 : 0.0f));
}

// Each found by its name, with the same numbers and pictures.
void expect_same_materials(const TriMesh& plain, const TriMesh& other) {
    for (const Material& was : plain.material_table) {
        if (was.name != "all" && was.name != "unlit") continue;
        SCOPED_TRACE(was.name);
        const auto is = std::ranges::find(other.material_table, was.name, &Material::name);
        ASSERT_NE(is, other.material_table.end());
        EXPECT_EQ(is->shading, was.shading);
        EXPECT_EQ(is->base_colour, was.base_colour);
        EXPECT_EQ(is->roughness, was.roughness);
        EXPECT_EQ(is->alpha_mode, was.alpha_mode);
        EXPECT_EQ(is->double_sided, was.double_sided);
        for (size_t k = 0; k < texture_names.size(); ++k) {
            const Texture &a = texture_of(was, k), &b = texture_of(*is, k);
            ASSERT_EQ(a.there(), b.there()) << texture_names[k];
            if (!a.there()) continue;
            EXPECT_EQ(plain.images[static_cast<size_t>(a.image)].texels,
                      other.images[static_cast<size_t>(b.image)].texels);
            EXPECT_EQ(a.wrap, b.wrap);
            EXPECT_EQ(a.second, b.second);
        }
    }
}

TEST(Encoders, OfOthersLoseNoMoreThanTheirBits) {
    const fs::path folder = fs::temp_directory_path() / ("lodestone_encoders_" + std::to_string(::getpid()));
    fs::create_directories(folder);
    const TriMesh mesh = ring();
    ASSERT_TRUE(mesh.validate());
    ASSERT_TRUE(write_mesh(mesh, folder / "plain.glb"));
    const auto plain = read_mesh(folder / "plain.glb");
    ASSERT_TRUE(plain) << plain.error().message;
    std::string names;
    for (const auto& [name, loss] : ways(mesh)) names += " " + name;
    const fixtures::NodeEnd end = fixtures::run_node("encode.mjs", folder, "plain.glb" + names);
    if (end.is_missing()) {
        fs::remove_all(folder);
        GTEST_SKIP() << fixtures::missing_npm_note();
    }
    ASSERT_EQ(end.code, 0) << end.printed;
    for (const auto& [name, loss] : ways(mesh)) {
        SCOPED_TRACE(name);
        ReadReport told;
        const auto read = read_mesh(folder / (name + ".glb"), {}, &told);
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_THAT(told.warnings, testing::IsEmpty());
        EXPECT_LT(fs::file_size(folder / (name + ".glb")), fs::file_size(folder / "plain.glb"));
        expect_equal(*plain, *read, loss);
        expect_same_materials(*plain, *read);
    }
    fs::remove_all(folder);
}

}  // namespace
}  // namespace lodestone
