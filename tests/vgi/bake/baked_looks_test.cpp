// Textures that lie in the atlas: what was painted through fragments of texture coordinates comes back by place.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "base/looks/srgb.h"
#include "base/random.h"
#include "fixtures/materials.h"
#include "fixtures/meshes.h"
#include "mesh/repair.h"
#include "vgi/asset/pages.h"
#include "vgi/bake/bake.h"
#include "vgi/draw/attributes/attribute_pages.h"
#include "vgi/draw/attributes/mip_tail.h"

namespace lodestone::vgi {
namespace {

// A colour for every place, smooth.
glm::vec3 painted(const glm::vec3& p) {
    return 0.5f + 0.4f * glm::vec3(std::sin(5 * p.x), std::sin(4 * p.z + 1), std::sin(3 * p.x - 4 * p.z));
}

constexpr int side = 12, cell = 24, gutter = 4;  // quads; texels of each in the texture, and of those what is around

// A bumpy grid of which each quad has a place of its own in the texture, turned and far from its neighbours'.
TriMesh in_fragments() {
    TriMesh mesh = fixtures::bumpy_grid(side, side);
    const TriMesh smooth = mesh;
    mesh.wedge_vertex.clear();
    mesh.triangles.clear();
    mesh.normals.clear();
    mesh.uvs.clear();
    constexpr float size = side * cell;
    for (size_t q = 0; q < smooth.triangle_count() / 2; ++q) {
        const auto place = static_cast<int>((q * 37 + 11) % (side * side));
        const glm::vec2 corner(place % side * cell + gutter, place / side * cell + gutter);
        std::vector<uint32_t> seen;
        for (size_t t = 2 * q; t < 2 * q + 2; ++t) {
            for (const uint32_t w : smooth.triangles[t]) {
                if (std::ranges::find(seen, w) == seen.end()) seen.push_back(w);
            }
        }
        // In its square, a quarter turn for each number.
        glm::vec2 low(1e9f), high(-1e9f);
        const auto flat = [&](uint32_t w) {
            const glm::vec3 p = smooth.positions[smooth.wedge_vertex[w]];
            return glm::vec2(p.x, p.z);
        };
        for (const uint32_t w : seen) {
            low = glm::min(low, flat(w));
            high = glm::max(high, flat(w));
        }
        const auto first = static_cast<uint32_t>(mesh.wedge_vertex.size());
        for (const uint32_t w : seen) {
            glm::vec2 at = (flat(w) - low) / (high - low);
            for (size_t turn = 0; turn < q % 4; ++turn) at = {1 - at.y, at.x};
            mesh.wedge_vertex.push_back(smooth.wedge_vertex[w]);
            mesh.normals.push_back(smooth.normals.empty() ? glm::vec3(0, 1, 0) : smooth.normals[w]);
            mesh.uvs.push_back((corner + at * static_cast<float>(cell - 2 * gutter)) / size);
        }
        for (size_t t = 2 * q; t < 2 * q + 2; ++t) {
            Triangle triangle;
            for (size_t k = 0; k < 3; ++k)
                triangle[k] =
                    first + static_cast<uint32_t>(std::ranges::find(seen, smooth.triangles[t][k]) - seen.begin());
            mesh.triangles.push_back(triangle);
        }
    }
    mesh.colours.clear();
    mesh.materials.assign(mesh.wedge_count(), 0);
    mesh.material_table.resize(1);
    mesh.material_table[0].base_colour_texture.image = 0;
    return mesh;
}

// Paints the texture, beyond each quad's own part, too.
void paint(TriMesh& mesh) {
    constexpr uint32_t size = side * cell;
    Image image{size, size, std::vector<glm::u8vec4>(size_t{size} * size, glm::u8vec4(255, 0, 255, 255))};
    for (size_t q = 0; q < mesh.triangle_count() / 2; ++q) {
        // A quad's corners in the texture and in space tell where each texel lies: the same plane map for all of it.
        const Triangle& t = mesh.triangles[2 * q];
        const glm::vec2 a = mesh.uvs[t[0]], e = mesh.uvs[t[1]] - a, f = mesh.uvs[t[2]] - a;
        const glm::vec3 p = mesh.position_of(2 * q, 0), pe = mesh.position_of(2 * q, 1) - p,
                        pf = mesh.position_of(2 * q, 2) - p;
        const float det = e.x * f.y - f.x * e.y;
        glm::vec2 middle(0);
        for (const size_t k : {size_t{0}, size_t{1}, size_t{2}}) middle += mesh.uvs[t[k]];
        const auto place = glm::ivec2(middle / 3.0f * static_cast<float>(size)) / cell * cell;
        for (int y = 0; y < cell; ++y) {
            for (int x = 0; x < cell; ++x) {
                const glm::ivec2 texel = place + glm::ivec2(x, y);
                const glm::vec2 off = (glm::vec2(texel) + 0.5f) / static_cast<float>(size) - a;
                const glm::vec3 at =
                    p + pe * ((off.x * f.y - f.x * off.y) / det) + pf * ((e.x * off.y - off.x * e.y) / det);
                const glm::vec3 colour = painted(at);
                image.texels[static_cast<size_t>(texel.y) * size + static_cast<size_t>(texel.x)] =
                    glm::u8vec4(glm::round(colour * 255.0f), 255);
            }
        }
    }
    mesh.images.push_back(std::move(image));
}

Atlas baked(const TriMesh& mesh, bool bake_textures = true) {
    AtlasOptions options;
    options.clusters.clusters = 8;
    options.cells = 16;
    options.bake_textures = bake_textures;
    AtlasReport report;
    auto atlas = make_atlas(mesh, options, report);
    EXPECT_TRUE(atlas);
    return std::move(*atlas);
}

TEST(BakedLooks, WhatWasPaintedThroughFragmentsComesBackByPlace) {
    TriMesh mesh = in_fragments();
    paint(mesh);
    ASSERT_TRUE(repair(mesh));
    const Atlas atlas = baked(mesh);
    EXPECT_TRUE(atlas.attributes.baked);
    EXPECT_FALSE(atlas.attributes.uvs);
    EXPECT_TRUE(atlas.uvs.empty());
    // As many samples as texels that are used, or up to four times.
    const double texels = side * side * (cell - 2 * gutter) * (cell - 2 * gutter);
    EXPECT_GT(static_cast<double>(atlas.attribute_texels()), 0.9 * texels);
    EXPECT_LT(static_cast<double>(atlas.attribute_texels()), 5 * texels);
    double squared = 0;
    size_t samples = 0;
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const uint32_t ratio = atlas.attribute_ratio_of(c);
        for (uint32_t y = 0; y <= atlas.cells_of(c); ++y) {
            for (uint32_t x = 0; x <= atlas.cells_of(c); ++x, ++samples) {
                const glm::vec3 wanted = painted(atlas.position(atlas.texel(c, x, y)));
                const glm::u8vec4 is = atlas.colours[atlas.attribute_texel(c, x * ratio, y * ratio)];
                for (int k = 0; k < 3; ++k)
                    squared += std::pow(static_cast<double>(is[k]) / 255 - static_cast<double>(wanted[k]), 2);
            }
        }
    }
    const double psnr = -10 * std::log10(squared / (3 * static_cast<double>(samples)));
    RecordProperty("psnr_db", std::to_string(psnr));
    EXPECT_GT(psnr, 40);
}

// Two pieces alike, one of which has a hundredth of the texels: it has as many fewer samples, by powers of two.
TEST(BakedLooks, EveryPieceHasAsManySamplesAsTexels) {
    TriMesh mesh = in_fragments();
    paint(mesh);
    const TriMesh coarse = mesh;
    const auto vertices = static_cast<uint32_t>(mesh.vertex_count()),
               wedges = static_cast<uint32_t>(mesh.wedge_count());
    for (const glm::vec3& at : coarse.positions) mesh.positions.push_back(at + glm::vec3(100, 0, 0));
    for (const uint32_t v : coarse.wedge_vertex) mesh.wedge_vertex.push_back(v + vertices);
    for (const glm::vec2& uv : coarse.uvs) mesh.uvs.push_back(0.1f * uv);
    mesh.normals.insert(mesh.normals.end(), coarse.normals.begin(), coarse.normals.end());
    mesh.materials.insert(mesh.materials.end(), coarse.materials.begin(), coarse.materials.end());
    for (const Triangle& t : coarse.triangles) mesh.triangles.push_back({t[0] + wedges, t[1] + wedges, t[2] + wedges});
    ASSERT_TRUE(repair(mesh));
    const Atlas atlas = baked(mesh);
    const auto valid = atlas.validate();
    ASSERT_TRUE(valid) << valid.error().message;
    const double texels = side * side * (cell - 2 * gutter) * (cell - 2 * gutter);
    std::array<double, 2> samples{}, of_positions{};
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const size_t piece = atlas.position(atlas.texel(c, 0, 0)).x > 50 ? 1 : 0;
        samples[piece] += std::pow(atlas.attribute_cells_of(c), 2);
        of_positions[piece] += std::pow(atlas.cells_of(c), 2);
    }
    EXPECT_GT(samples[0], 0.75 * texels);
    EXPECT_LT(samples[0], 3 * texels + 1);
    EXPECT_GE(samples[1], of_positions[1]);
    EXPECT_LT(samples[1], std::max(of_positions[1], samples[0] / 4) + 1);
    EXPECT_LT(samples[1], samples[0]);
}

// Fragments of unlike colours: where charts meet, they agree.
TEST(BakedLooks, ChartsAgreeWhereTheyMeet) {
    TriMesh mesh = in_fragments();
    paint(mesh);
    constexpr uint32_t size = side * cell;
    for (uint32_t i = 0; i < size * size; ++i) {
        const uint32_t place = i / size / cell * side + i % size / cell;
        mesh.images[0].texels[i] = glm::u8vec4(place * 97 % 256, place * 31 % 256, place * 53 % 256, 255);
    }
    ASSERT_TRUE(repair(mesh));
    const Atlas atlas = baked(mesh);
    std::vector<glm::u8vec4> border;
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const uint32_t n = atlas.attribute_cells_of(c);
        for (uint32_t s = 0; s < 4; ++s) {
            const GluedSide& other = atlas.sides[4 * c + s];
            if (other.chart == ~0u || atlas.attribute_cells_of(other.chart) != n) continue;
            for (uint32_t k = 0; k <= n; ++k) {
                const auto [x, y] = on_side(s, k, n);
                const auto [u, v] = on_side(other.side, n - k, n);
                border.push_back(atlas.colours[atlas.attribute_texel(c, x, y)]);
                ASSERT_EQ(border.back(), atlas.colours[atlas.attribute_texel(other.chart, u, v)])
                    << c << ", " << s << ", " << k;
            }
        }
    }
    EXPECT_GT(border.size(), 100u);
    EXPECT_TRUE(std::ranges::any_of(border, [&](const glm::u8vec4& colour) { return colour != border[0]; }));
}

// A map leans normals another way in each fragment: where charts meet they agree, but not where they are as far apart
// as on an edge.
TEST(BakedLooks, NormalsAgreeWhereChartsMeetWithoutAnEdge) {
    const auto differing = [](float lean) {
        TriMesh mesh = in_fragments();
        mesh.material_table[0].base_colour_texture = {};
        mesh.material_table[0].normal_texture.image = 0;
        const glm::vec3 normal = glm::normalize(glm::vec3(lean, 0, 1));
        constexpr uint32_t size = side * cell;
        mesh.images.push_back({size, size, std::vector<glm::u8vec4>(size_t{size} * size)});
        for (glm::u8vec4& texel : mesh.images[0].texels)
            texel = glm::u8vec4(glm::round((normal * 0.5f + 0.5f) * 255.0f), 255);
        EXPECT_TRUE(repair(mesh));
        const Atlas atlas = baked(mesh);
        EXPECT_TRUE(atlas.attributes.mapped_normals);
        size_t count = 0;
        for (uint32_t c = 0; c < atlas.charts(); ++c) {
            const uint32_t n = atlas.attribute_cells_of(c);
            for (uint32_t s = 0; s < 4; ++s) {
                const GluedSide& other = atlas.sides[4 * c + s];
                for (uint32_t k = 0; other.chart != ~0u && k <= n; ++k) {
                    const auto [x, y] = on_side(s, k, n);
                    const auto [u, v] = on_side(other.side, n - k, n);
                    count += atlas.normals[atlas.attribute_texel(c, x, y)] !=
                             atlas.normals[atlas.attribute_texel(other.chart, u, v)];
                }
            }
        }
        return count;
    };
    EXPECT_EQ(differing(0.15f), 0u);
    EXPECT_GT(differing(1.0f), 20u);
}

// Black and white in turn: from far away it is as bright as half the light, 188, not half the number, 128.
TEST(BakedLooks, FarAwayIsAsBrightAsNearBy) {
    TriMesh mesh = in_fragments();
    paint(mesh);
    ASSERT_TRUE(repair(mesh));
    Atlas atlas = baked(mesh);
    std::vector<std::shared_ptr<const AttributePage>> coarsest;
    const auto tree = tree_of(atlas, Layer::attributes);
    const uint32_t words = attribute_words(atlas.attributes);
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const uint32_t n = atlas.attribute_cells_of(c);
        for (uint32_t y = 0; y <= n; ++y) {
            for (uint32_t x = 0; x <= n; ++x)
                atlas.colours[atlas.attribute_texel(c, x, y)] = glm::u8vec4(glm::u8vec3((x + y) % 2 * 255), 255);
        }
        coarsest.push_back(std::make_shared<const AttributePage>(
            packed_attributes(read_pages(atlas, Layer::attributes, c)[0], tree, atlas.attributes, words)));
    }
    const AttributePage tail = mip_tail(atlas, coarsest, words);
    const uint32_t samples = mip_tail_samples(tree.cells_per_page());
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const uint32_t last = tail[(size_t{c + 1} * samples - 1) * words + 1];
        for (int k = 0; k < 3; ++k) {
            EXPECT_GT(last >> (8 * k) & 255, 170u);
            EXPECT_LT(last >> (8 * k) & 255, 206u);
        }
        EXPECT_EQ(last >> 24, 255u);
    }
}

// What textures say of metal, roughness, occlusion, emission and normals.
TEST(BakedLooks, KeepsEveryKindOfTexture) {
    TriMesh mesh = fixtures::grid(8, 8);
    ASSERT_FALSE(mesh.uvs.empty());
    mesh.materials.assign(mesh.wedge_count(), 0);
    mesh.material_table.resize(1);
    Material& m = mesh.material_table[0];
    const auto add = [&](Texture& texture, glm::u8vec4 texel) {
        texture.image = static_cast<int32_t>(mesh.images.size());
        mesh.images.push_back({4, 4, std::vector<glm::u8vec4>(16, texel)});
    };
    add(m.base_colour_texture, {10, 20, 30, 40});
    add(m.metallic_roughness_texture, {1, 60, 70, 255});
    add(m.occlusion_texture, {80, 2, 3, 255});
    add(m.emission_texture, {90, 100, 110, 255});
    // Half a right angle towards where the first texture coordinate grows.
    add(m.normal_texture, {218, 128, 218, 255});
    ASSERT_TRUE(repair(mesh));
    const Atlas atlas = baked(mesh);
    ASSERT_TRUE(atlas.attributes.surfaces && atlas.attributes.emissions && atlas.attributes.mapped_normals);
    // Which way that is on the grid.
    const Triangle& t = mesh.triangles[0];
    const glm::vec3 e = mesh.position_of(0, 1) - mesh.position_of(0, 0),
                    f = mesh.position_of(0, 2) - mesh.position_of(0, 0);
    const glm::vec2 uv_e = mesh.uvs[t[1]] - mesh.uvs[t[0]], uv_f = mesh.uvs[t[2]] - mesh.uvs[t[0]];
    const float det = uv_e.x * uv_f.y - uv_f.x * uv_e.y;
    const glm::vec3 along = glm::normalize((e * uv_f.y - f * uv_e.y) / det),
                    wanted = glm::normalize(along + glm::normalize(glm::cross(e, f)));
    for (size_t i = 0; i < atlas.attribute_texels(); ++i) {
        ASSERT_EQ(atlas.colours[i], glm::u8vec4(10, 20, 30, 40));
        ASSERT_EQ(atlas.surfaces[i], (std::array<uint8_t, 3>{80, 60, 70}));
        ASSERT_EQ(atlas.emissions[i], (std::array<uint8_t, 3>{90, 100, 110}));
        ASSERT_GT(glm::dot(atlas.normal(i), wanted), 0.999f);
    }
}

// Every kind but base colour, of images that differ all over.
TriMesh with_maps() {
    TriMesh mesh = fixtures::bumpy_grid(12, 12);
    mesh.materials.assign(mesh.wedge_count(), 0);
    mesh.material_table.resize(1);
    Random random(5);
    for (const size_t k : {1, 2, 3, 4}) {
        mesh.material_table[0].textures()[k]->image = static_cast<int32_t>(mesh.images.size());
        Image image{16, 24, {}};
        for (int i = 0; i < 16 * 24; ++i) {
            const auto byte = [&] { return static_cast<uint8_t>(64 + random.below(128)); };
            image.texels.emplace_back(byte(), byte(), 220, 255);
        }
        mesh.images.push_back(std::move(image));
    }
    EXPECT_TRUE(repair(mesh));
    return mesh;
}

TEST(BakedLooks, TexturesOfTheSecondSetAreBakedLikeThoseOfTheFirst) {
    const TriMesh first = with_maps();
    TriMesh second = first;
    second.second_uvs = first.uvs;
    for (glm::vec2& uv : second.uvs) uv = {0.5f * uv.y, 0.5f};
    for (const size_t k : {1, 2, 3, 4}) second.material_table[0].textures()[k]->second = true;
    const Atlas expected = baked(first), found = baked(second);
    EXPECT_TRUE(found.attributes.baked);
    EXPECT_EQ(found.attribute_cells, expected.attribute_cells);
    EXPECT_EQ(found.surfaces, expected.surfaces);
    EXPECT_EQ(found.emissions, expected.emissions);
    EXPECT_EQ(found.normals, expected.normals);
}

// The tangents say what texture coordinates say, or are mirrored where the map's green is upside down.
TEST(BakedLooks, MapsOfNormalsAreInTheFrameOfTangents) {
    TriMesh mesh = fixtures::with_tangents_of_triangles(with_maps(), false);
    mesh.tangents.clear();
    const Atlas by_texcoords = baked(mesh);
    const auto furthest = [&](const TriMesh& of) {
        const Atlas atlas = baked(of);
        EXPECT_EQ(atlas.attribute_cells, by_texcoords.attribute_cells);
        double worst = 0;
        for (size_t i = 0; i < atlas.attribute_texels(); ++i)
            worst = std::max(worst, static_cast<double>(glm::distance(atlas.normal(i), by_texcoords.normal(i))));
        return worst;
    };
    const double step = 0.03;  // of packed normals
    EXPECT_LT(furthest(fixtures::with_tangents_of_triangles(mesh, false)), step);
    TriMesh mirrored = fixtures::with_tangents_of_triangles(mesh, true);
    EXPECT_GT(furthest(mirrored), 0.3);
    fixtures::turn_green_over(mirrored.images[1]);
    EXPECT_LT(furthest(mirrored), step);
    // Those that are none leave it to texture coordinates.
    mirrored = mesh;
    mirrored.tangents.assign(mesh.wedge_count(), glm::vec4(0));
    EXPECT_LT(furthest(mirrored), step);
}

TEST(BakedLooks, TexturesOnTwoSetsAreBakedWhateverIsAsked) {
    TriMesh mesh = with_maps();
    EXPECT_FALSE(baked(mesh, false).attributes.baked);
    mesh.second_uvs = mesh.uvs;
    EXPECT_FALSE(baked(mesh, false).attributes.baked) << "no texture is on the second";
    mesh.material_table[0].occlusion_texture.second = true;
    const Atlas atlas = baked(mesh, false);
    EXPECT_TRUE(atlas.attributes.baked);
    EXPECT_FALSE(atlas.attributes.uvs);
    EXPECT_FALSE(atlas.surfaces.empty());
}

TEST(BakedLooks, AMeshWithoutTexturesIsAsEver) {
    const Atlas atlas = baked(fixtures::repaired(Shape::rock, 2000));
    EXPECT_FALSE(atlas.attributes.baked);
    EXPECT_TRUE(atlas.colours.empty());
}

}  // namespace
}  // namespace lodestone::vgi
