#include "vgi/unwrap/unwrap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <map>

#include "base/random.h"
#include "base/structures/disjoint_sets.h"
#include "base/threads.h"
#include "fixtures/meshes.h"
#include "fixtures/real_data.h"
#include "mesh/predicates.h"
#include "mesh/repair.h"
#include "vgi/unwrap/texture_bake.h"

namespace lodestone::vgi {
namespace {

struct Made {
    Unwrapped result;
    UnwrapReport report;
};
Made unwrapped(const TriMesh& mesh, const UnwrapOptions& options = {}) {
    Made made;
    auto result = unwrap(mesh, options, made.report);
    EXPECT_TRUE(result) << (result ? "" : result.error().message);
    if (result) made.result = std::move(*result);
    return made;
}

glm::dvec2 uv_of(const TriMesh& mesh, size_t t, size_t k) { return glm::dvec2(mesh.uvs[mesh.triangles[t][k]]); }

double area_in_space(const TriMesh& mesh) {
    double area = 0;
    for (size_t t = 0; t < mesh.triangle_count(); ++t)
        area += glm::length(glm::cross(glm::dvec3(mesh.position_of(t, 1) - mesh.position_of(t, 0)),
                                       glm::dvec3(mesh.position_of(t, 2) - mesh.position_of(t, 0)))) /
                2;
    return area;
}

// Whether a point is inside a triangle, not on its border; the image's rows go down.
bool inside(const TriMesh& mesh, size_t t, const glm::dvec2& p) {
    for (size_t k = 0; k < 3; ++k) {
        if (orientation(uv_of(mesh, t, k), uv_of(mesh, t, (k + 1) % 3), p) >= 0) return false;
    }
    return true;
}

TEST(Unwrap, NoPointOfASquareIsInTwoTriangles) {
    for (const auto& [name, mesh] : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(name);
        UnwrapOptions options;
        options.gutter = 1.0 / 256;
        const TriMesh made = unwrapped(mesh, options).result.mesh;
        ASSERT_TRUE(made.validate());
        Random random(1);
        for (int i = 0; i < 300; ++i) {
            const glm::dvec2 p(random.unit(), random.unit());
            int count = 0;
            for (size_t t = 0; t < made.triangle_count(); ++t) count += inside(made, t, p);
            EXPECT_LE(count, 1);
        }
    }
}

TEST(Unwrap, NothingIsTurnedOver) {
    for (const auto& [name, mesh] : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(name);
        const TriMesh made = unwrapped(mesh).result.mesh;
        for (size_t t = 0; t < made.triangle_count(); ++t)
            EXPECT_EQ(orientation(uv_of(made, t, 0), uv_of(made, t, 1), uv_of(made, t, 2)), -1) << t;
        for (const glm::vec2& uv : made.uvs) {
            EXPECT_TRUE(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1);
            EXPECT_EQ(1 - (1 - uv.y), uv.y) << "formats that count rows from below lose nothing";
        }
    }
}

TEST(Unwrap, KeepsVerticesSurfaceAndAttributes) {
    for (const auto& [name, mesh] : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(name);
        const Made made = unwrapped(mesh);
        const TriMesh& m = made.result.mesh;
        ASSERT_GE(m.vertex_count(), mesh.vertex_count());
        EXPECT_TRUE(std::ranges::equal(std::span(m.positions).first(mesh.vertex_count()), mesh.positions));
        EXPECT_NEAR(area_in_space(m), area_in_space(mesh), 1e-5 * area_in_space(mesh));
        EXPECT_EQ(m.normals.empty(), mesh.normals.empty());
        EXPECT_EQ(m.colours.empty(), mesh.colours.empty());
        for (size_t t = 0; t < m.triangle_count(); ++t) {
            const SurfaceTriangle& part = made.result.parts[t];
            if (part.places != none) continue;  // cut: between
            for (size_t k = 0; k < 3; ++k) {
                const uint32_t now = m.triangles[t][k], was = mesh.triangles[part.source][k];
                EXPECT_EQ(m.wedge_vertex[now], mesh.wedge_vertex[was]);
                if (!m.normals.empty()) { EXPECT_EQ(m.normals[now], mesh.normals[was]); }
                if (!m.colours.empty()) { EXPECT_EQ(m.colours[now], mesh.colours[was]); }
            }
        }
    }
}

TEST(Unwrap, ChartsKeepTheirGutter) {
    UnwrapOptions options;
    options.gutter = 1.0 / 100;
    const TriMesh mesh = unwrapped(fixtures::repaired(Shape::rock, 4000), options).result.mesh;
    DisjointSets joined(mesh.wedge_count());
    for (const Triangle& t : mesh.triangles) {
        joined.join(t[0], t[1]);
        joined.join(t[1], t[2]);
    }
    std::map<uint32_t, std::pair<glm::vec2, glm::vec2>> boxes;
    for (uint32_t w = 0; w < mesh.wedge_count(); ++w) {
        auto& [low, high] = boxes.try_emplace(joined.find(w), mesh.uvs[w], mesh.uvs[w]).first->second;
        low = glm::min(low, mesh.uvs[w]);
        high = glm::max(high, mesh.uvs[w]);
    }
    EXPECT_GT(boxes.size(), 8u);
    for (auto a = boxes.begin(); a != boxes.end(); ++a) {
        for (auto b = std::next(a); b != boxes.end(); ++b) {
            const glm::vec2 gap = glm::max(b->second.first - a->second.second, a->second.first - b->second.second);
            EXPECT_GE(std::max(gap.x, gap.y), options.gutter - 1e-5);
        }
    }
}

TEST(Unwrap, StretchIsSmallAndHardlyAnythingIsCut) {
    for (const Shape shape : {Shape::rock, Shape::torus}) {
        const Made made = unwrapped(fixtures::repaired(shape, 20000));
        EXPECT_LT(made.report.l2_stretch_rms, 1.3);
        EXPECT_GT(made.report.l2_stretch_rms, 0.999);
        EXPECT_LT(made.report.l2_stretch_worst, 3.2);
        EXPECT_LE(static_cast<double>(made.report.triangles), 1.05 * static_cast<double>(made.report.source_triangles));
        EXPECT_GT(made.report.coverage, 0.85);
    }
}

TEST(Unwrap, SeveralSquaresHaveMaterialsOfTheirOwn) {
    UnwrapOptions options;
    options.textures = 3;
    const Unwrapped made = unwrapped(fixtures::repaired(Shape::rock, 6000), options).result;
    ASSERT_EQ(made.mesh.material_table.size(), 3u);
    std::vector<size_t> used(3, 0);
    for (size_t t = 0; t < made.mesh.triangle_count(); ++t) {
        ++used[made.square[t]];
        EXPECT_EQ(made.mesh.materials[made.mesh.triangles[t][0]], made.square[t]);
    }
    for (const size_t count : used) EXPECT_GT(count, 1000u);
}

TEST(Unwrap, IsTheSameForAnyNumberOfThreads) {
    const TriMesh rock = fixtures::repaired(Shape::rock, 5000);
    std::vector<TriMesh> made;
    for (const unsigned threads : {1u, 3u}) {
        set_thread_count(threads);
        made.push_back(unwrapped(rock).result.mesh);
    }
    set_thread_count(0);
    EXPECT_EQ(made[0].uvs, made[1].uvs);
    EXPECT_EQ(made[0].triangles, made[1].triangles);
    EXPECT_EQ(made[0].positions, made[1].positions);
}

TEST(Unwrap, LoneTrianglesBecomeChartsAsTheyAre) {
    TriMesh mesh;
    for (int i = 0; i < 5; ++i) {
        const auto x = static_cast<float>(i) * 3;
        mesh.positions.insert(mesh.positions.end(), {{x, 0, 0}, {x + 2, 0, 0}, {x, 1, 0}});
        const auto first = static_cast<uint32_t>(i * 3);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    mesh.set_identity_wedges();
    const Made made = unwrapped(mesh);
    EXPECT_EQ(made.report.triangles, 5u);
    EXPECT_EQ(made.report.charts, 5u);
    EXPECT_LT(made.report.l2_stretch_rms, 1.1);
}

TEST(Unwrap, GuttersWithoutRoomAreWrongUsage) {
    UnwrapOptions options;
    options.gutter = 0.4;
    UnwrapReport report;
    const auto made = unwrap(fixtures::repaired(Shape::rock, 2000), options, report);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().fault, Fault::usage);
}

// A colour that depends on where a point of the surface is.
glm::dvec3 colour_at(const glm::dvec3& p) {
    return glm::dvec3(0.5) + 0.35 * glm::dvec3(std::sin(3 * p.x + 1), std::sin(4 * p.y), std::sin(3 * p.z + p.x));
}

// The mesh with a texture in which every pair of triangles has a cell of its own, in an order of no sense: scans come
// so.
TriMesh painted(TriMesh mesh, uint32_t cell) {
    const auto pairs = static_cast<uint32_t>((mesh.triangle_count() + 1) / 2);
    const auto row = static_cast<uint32_t>(std::ceil(std::sqrt(pairs)));
    Image image{row * cell, row * cell, {}};
    image.texels.assign(size_t{image.width} * image.height, {0, 0, 0, 255});
    TriMesh made;
    made.positions = mesh.positions;
    for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
        const uint32_t slot = (t / 2 * 7919u) % pairs;
        const glm::dvec2 corner(slot % row * cell, slot / row * cell);
        const double side = cell - 4;
        // The lower left or the upper right half of the cell.
        const glm::dvec2 at[3] = {t % 2 == 0 ? glm::dvec2(1, 1) : glm::dvec2(side + 3, side + 3),
                                  t % 2 == 0 ? glm::dvec2(side, 1) : glm::dvec2(4, side + 3),
                                  t % 2 == 0 ? glm::dvec2(1, side) : glm::dvec2(side + 3, 4)};
        const glm::dvec3 p(mesh.position_of(t, 0)), e = glm::dvec3(mesh.position_of(t, 1)) - p,
                                                    f = glm::dvec3(mesh.position_of(t, 2)) - p;
        for (uint32_t y = 0; y < cell; ++y) {
            for (uint32_t x = 0; x < cell; ++x) {
                const glm::dvec2 texel(x + 0.5, y + 0.5), off = texel - at[0];
                const double u = off.x / (at[1].x - at[0].x), v = off.y / (at[2].y - at[0].y);
                if ((t % 2 == 0) != (texel.x + texel.y < cell)) continue;
                const glm::dvec3 c = colour_at(p + e * u + f * v);
                image.texels[static_cast<size_t>(corner.y + y) * image.width + static_cast<size_t>(corner.x) + x] = {
                    std::lround(255 * c.x), std::lround(255 * c.y), std::lround(255 * c.z), 255};
            }
        }
        for (int k = 0; k < 3; ++k) {
            made.wedge_vertex.push_back(mesh.vertex_of(t, k));
            made.uvs.emplace_back((corner + at[k]) / static_cast<double>(image.width));
        }
        made.triangles.push_back({t * 3, t * 3 + 1, t * 3 + 2});
    }
    Material material;
    material.base_colour_texture.image = 0;
    made.material_table = {material};
    made.materials.assign(made.wedge_count(), 0);
    made.images.push_back(std::move(image));
    return made;
}

glm::dvec3 texel_at(const Image& image, const glm::dvec2& uv) {
    const auto x = static_cast<size_t>(uv.x * image.width), y = static_cast<size_t>(uv.y * image.height);
    return glm::dvec3(image.texels[y * image.width + x]) / 255.0;
}

TEST(TextureBake, WhatWasPaintedThroughFragmentsComesBack) {
    const TriMesh source = painted(fixtures::repaired(Shape::rock, 1200), 32);
    const Unwrapped made = unwrapped(source).result;
    const auto images = bake_textures(source, made, 1, 1024).of(Look::colour);
    ASSERT_EQ(images.size(), 1u);
    double squared = 0;
    size_t count = 0;
    Random random(5);
    for (size_t t = 0; t < made.mesh.triangle_count(); ++t) {
        double a = random.unit(), b = random.unit();
        if (a + b > 1) a = 1 - a, b = 1 - b;
        glm::dvec3 p(0);
        glm::dvec2 uv(0);
        const double weights[3] = {1 - a - b, a, b};
        for (int k = 0; k < 3; ++k) {
            p += weights[k] * glm::dvec3(made.mesh.position_of(t, k));
            uv += weights[k] * uv_of(made.mesh, t, static_cast<size_t>(k));
        }
        const glm::dvec3 off = texel_at(images[0], uv) - colour_at(p);
        squared += glm::dot(off, off) / 3;
        ++count;
    }
    EXPECT_GT(-10 * std::log10(squared / static_cast<double>(count)), 36);
}

TEST(TextureBake, OneColourFillsTheWholeSquare) {
    TriMesh source = fixtures::grid(8, 8);
    Material red;
    red.base_colour = {1, 0.25f, 0, 1};
    source.material_table = {red};
    source.materials.assign(source.wedge_count(), 0);
    const Unwrapped made = unwrapped(source).result;
    const BakedTextures baked = bake_textures(source, made, 1, 128);
    for (const Image& image : baked.of(Look::colour)) {
        for (const glm::u8vec4& t : image.texels) EXPECT_EQ(t, glm::u8vec4(255, 137, 0, 255));
    }
}

TEST(TextureBake, ColoursAreMeansOfLight) {
    TriMesh source = fixtures::grid(2, 2);
    Image image{64, 64, {}};
    for (size_t i = 0; i < 64 * 64; ++i)
        image.texels.emplace_back((i + i / 64) % 2 == 0 ? glm::u8vec4(255) : glm::u8vec4(0, 0, 0, 255));
    source.images.push_back(image);
    Material material;
    material.base_colour_texture.image = 0;
    source.material_table = {material};
    source.materials.assign(source.wedge_count(), 0);
    const Unwrapped made = unwrapped(source).result;
    const Image small = bake_textures(source, made, 1, 8).of(Look::colour)[0];
    for (const glm::u8vec4& t : small.texels) EXPECT_NEAR(t.x, 188, 12);  // half of the light, not half of the byte
}

class UnwrapRealMesh : public testing::TestWithParam<std::string> {};

TEST_P(UnwrapRealMesh, IsUnwrappedWithoutFaults) {
    if (!fixtures::real_data(GetParam())) GTEST_SKIP() << fixtures::missing_data_note(GetParam());
    const auto mesh = fixtures::repaired_real_mesh(GetParam());
    ASSERT_TRUE(mesh);
    const Made made = unwrapped(*mesh);
    EXPECT_EQ(made.report.flipped, 0u);
    EXPECT_EQ(made.report.overlapping, 0u);
    EXPECT_LE(static_cast<double>(made.report.triangles), 1.05 * static_cast<double>(made.report.source_triangles));
    EXPECT_LT(made.report.l2_stretch_rms, 1.4);
    EXPECT_LT(made.report.l2_stretch_worst, 4);
}

INSTANTIATE_TEST_SUITE_P(Data, UnwrapRealMesh, testing::Values("scans/laurana.ply", "scans/horse.ply"),
                         [](const auto& of) { return fixtures::test_name_of(of.param); });

}  // namespace
}  // namespace lodestone::vgi
