// What is baked beside colours: metal and roughness, occlusion, emission, normals.
#include "vgi/unwrap/old_looks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "base/random.h"
#include "fixtures/materials.h"
#include "fixtures/meshes.h"
#include "vgi/unwrap/texture_bake.h"

namespace lodestone::vgi {
namespace {

Unwrapped laid_out(const TriMesh& mesh, uint32_t textures = 1) {
    UnwrapOptions options;
    options.textures = textures;
    UnwrapReport report;
    auto made = unwrap(mesh, options, report);
    EXPECT_TRUE(made) << made.error().message;
    return made ? std::move(*made) : Unwrapped{};
}

// A square that shows each of its images once, of one material.
TriMesh square(const Material& material, std::vector<Image> images) {
    TriMesh mesh = fixtures::grid(2, 2);
    mesh.material_table = {material};
    mesh.materials.assign(mesh.wedge_count(), 0);
    mesh.images = std::move(images);
    return mesh;
}

Image checker(const glm::u8vec4& even, const glm::u8vec4& odd) {
    Image image{64, 64, {}};
    for (size_t i = 0; i < size_t{64} * 64; ++i) image.texels.push_back((i + i / 64) % 2 == 0 ? even : odd);
    return image;
}

TEST(OldLooks, ColoursAreMeansOfLightAllElseOfNumbers) {
    Material m;
    m.shading = Shading::metallic_roughness;
    m.metallic = 0.5f;
    m.roughness = 1;
    m.emission = {4, 2, 0};
    m.occlusion_strength = 0.5f;
    m.metallic_roughness_texture.image = m.occlusion_texture.image = m.emission_texture.image = 0;
    const TriMesh source = square(m, {checker({0, 0, 0, 255}, {255, 255, 255, 255})});
    const Unwrapped made = laid_out(source);
    const BakedTextures baked = bake_textures(source, made, 1, 8);
    EXPECT_TRUE(baked.metal && baked.occlusion);
    EXPECT_EQ(baked.brightest, 4);
    ASSERT_EQ(baked.of(Look::surface).size(), 1u);
    ASSERT_EQ(baked.of(Look::emission).size(), 1u);
    EXPECT_TRUE(baked.of(Look::normals).empty());
    for (const glm::u8vec4& t : baked.of(Look::surface)[0].texels) {
        EXPECT_NEAR(t.x, 191, 8) << "occlusion, of half strength";
        EXPECT_NEAR(t.y, 128, 12) << "roughness";
        EXPECT_NEAR(t.z, 64, 6) << "metal";
    }
    for (const glm::u8vec4& t : baked.of(Look::emission)[0].texels) {
        EXPECT_NEAR(t.x, 188, 12);
        EXPECT_NEAR(t.y, 137, 10) << "half as bright";
        EXPECT_EQ(t.z, 0);
    }
}

TEST(OldLooks, ImagesGoOnAsTheirTexturesSay) {
    // Looked up twice as far across the square: at 1.25 and 1.75 all three differ.
    const Image halves{2, 1, {{0, 0, 0, 255}, {255, 255, 255, 255}}};
    struct Expected {
        Wrap wrap;
        bool bright_at_1_25, bright_at_1_75;
    };
    for (const Expected& expected : {Expected{Wrap::repeat, false, true}, Expected{Wrap::clamp, true, true},
                                     Expected{Wrap::mirror, true, false}}) {
        Material m;
        m.emission = {1, 1, 1};
        m.emission_texture = {0, {expected.wrap, Wrap::repeat}, {{2, 0}, {0, 1}, {0, 0}}};
        const TriMesh source = square(m, {halves});
        const Unwrapped made = laid_out(source);
        const Image baked = bake_textures(source, made, 1, 256).of(Look::emission)[0];
        const Box box = bounding_box(made.mesh.positions);
        Random random(3);
        size_t looked_at = 0;
        for (size_t i = 0; i < 20000; ++i) {
            const size_t t = i % made.mesh.triangle_count();
            double a = random.unit(), b = random.unit();
            if (a + b > 1) a = 1 - a, b = 1 - b;
            const double weights[3] = {1 - a - b, a, b};
            glm::dvec2 uv(0);
            double x = 0;
            for (size_t k = 0; k < 3; ++k) {
                uv += weights[k] * glm::dvec2(made.mesh.uvs[made.mesh.triangles[t][k]]);
                x += weights[k] * static_cast<double>(made.mesh.position_of(t, static_cast<int>(k)).x);
            }
            const double across = 2 * (x - double{box.low.x}) / double{box.high.x - box.low.x};
            const bool first = std::abs(across - 1.25) < 0.02, second = std::abs(across - 1.75) < 0.02;
            if (!first && !second) continue;
            ++looked_at;
            const bool bright = first ? expected.bright_at_1_25 : expected.bright_at_1_75;
            const auto found = baked.texels[static_cast<size_t>(uv.y * 256) * 256 + static_cast<size_t>(uv.x * 256)].x;
            EXPECT_TRUE(bright ? found > 200 : found < 100) << across << " " << int{found};
        }
        EXPECT_GT(looked_at, 100u);
    }
}

// Across and up at a place of a triangle, by texture coordinates: up is against the direction in which rows go.
std::pair<glm::dvec3, glm::dvec3> frame(const TriMesh& mesh, size_t t, const glm::dvec3& n) {
    const glm::dvec3 p(mesh.position_of(t, 0)), e = glm::dvec3(mesh.position_of(t, 1)) - p,
                                                f = glm::dvec3(mesh.position_of(t, 2)) - p;
    const Triangle& w = mesh.triangles[t];
    const glm::dvec2 a(mesh.uvs[w[0]]), b = glm::dvec2(mesh.uvs[w[1]]) - a, c = glm::dvec2(mesh.uvs[w[2]]) - a;
    const double area = b.x * c.y - b.y * c.x;
    const glm::dvec3 by_u = (e * c.y - f * b.y) / area, by_v = (f * b.x - e * c.x) / area;
    const glm::dvec3 across = glm::normalize(by_u - n * glm::dot(n, by_u));
    glm::dvec3 up = glm::cross(n, across);
    if (glm::dot(up, by_v) > 0) up = -up;
    return {across, up};
}

glm::dvec3 middle_normal(const TriMesh& mesh, size_t t) {
    glm::dvec3 n(0);
    for (const uint32_t w : mesh.triangles[t]) n += glm::dvec3(mesh.normals[w]);
    return glm::normalize(n);
}

glm::dvec3 unpacked(const glm::u8vec4& texel) { return glm::normalize(glm::dvec3(texel) / 127.5 - 1.0); }

glm::dvec2 place_of(const TriMesh& mesh, size_t t, size_t corner) {
    return glm::dvec2(mesh.uvs[mesh.triangles[t][corner]]);
}

// Every triangle has a cell of an image that bends its normal some way, and lies in it turned somehow, mirrored or not.
TriMesh bent_everywhere(const TriMesh& shape) {
    constexpr uint32_t cell = 8;
    const auto row = static_cast<uint32_t>(std::ceil(std::sqrt(shape.triangle_count())));
    Image image{row * cell, row * cell, {}};
    image.texels.resize(size_t{image.width} * image.height);
    TriMesh made;
    made.positions = shape.positions;
    Random random(7);
    for (uint32_t t = 0; t < shape.triangle_count(); ++t) {
        const uint32_t x = t % row * cell, y = t / row * cell;
        const glm::dvec3 bend(random.unit() * 1.2 - 0.6, random.unit() * 1.2 - 0.6, 1);
        const glm::u8vec4 texel(glm::dvec4(glm::round(127.5 * (glm::normalize(bend) + 1.0)), 255));
        for (uint32_t i = 0; i < cell * cell; ++i)
            image.texels[size_t{y + i / cell} * image.width + x + i % cell] = texel;
        const double turn = 2 * std::numbers::pi * random.unit(), mirror = t % 3 == 0 ? -1 : 1;
        for (int k = 0; k < 3; ++k) {
            const double angle = turn + mirror * 2 * std::numbers::pi / 3 * k;
            made.wedge_vertex.push_back(shape.vertex_of(t, k));
            made.normals.push_back(shape.normals[shape.triangles[t][static_cast<size_t>(k)]]);
            made.uvs.emplace_back(
                (glm::dvec2(x, y) + double{cell} / 2 + 2.0 * glm::dvec2(std::cos(angle), std::sin(angle))) /
                static_cast<double>(image.width));
        }
        made.triangles.push_back({t * 3, t * 3 + 1, t * 3 + 2});
    }
    Material material;
    material.shading = Shading::metallic_roughness;
    material.normal_texture.image = 0;
    made.material_table = {material};
    made.materials.assign(made.wedge_count(), 0);
    made.images.push_back(std::move(image));
    return made;
}

TEST(OldLooks, NormalsAreTurnedIntoTheFrameOfTheNewCoordinates) {
    TriMesh shape = fixtures::repaired(Shape::torus, 1200);
    ASSERT_FALSE(shape.normals.empty());
    for (const float scale : {1.0f, 0.5f}) {
        TriMesh source = bent_everywhere(shape);
        source.material_table[0].normal_scale = scale;
        const Unwrapped made = laid_out(source);
        const Image baked = bake_textures(source, made, 1, 1024).of(Look::normals).at(0);
        double worst = 0, most_bent = 0;
        size_t compared = 0;
        for (size_t t = 0; t < made.mesh.triangle_count(); ++t) {
            const uint32_t was = made.parts[t].source;
            const glm::dvec2 uv =
                glm::dvec2(made.mesh.uvs[made.mesh.triangles[t][0]] + made.mesh.uvs[made.mesh.triangles[t][1]] +
                           made.mesh.uvs[made.mesh.triangles[t][2]]) /
                3.0;
            const glm::dvec3 n = middle_normal(made.mesh, t);
            const auto [old_across, old_up] = frame(source, was, n);
            const auto [across, up] = frame(made.mesh, t, n);
            const glm::vec2 old_uv =
                (source.uvs[size_t{was} * 3] + source.uvs[size_t{was} * 3 + 1] + source.uvs[size_t{was} * 3 + 2]) /
                3.0f;
            const Image& image = source.images[0];
            const auto texel_at = [](const Image& of, const glm::dvec2& at) {
                return of
                    .texels[static_cast<size_t>(at.y * of.height) * of.width + static_cast<size_t>(at.x * of.width)];
            };
            const glm::dvec3 before = unpacked(texel_at(image, old_uv)), after = unpacked(texel_at(baked, uv));
            const glm::dvec3 expected =
                glm::normalize(scale * before.x * old_across + scale * before.y * old_up + before.z * n);
            const glm::dvec2 e = place_of(made.mesh, t, 1) - place_of(made.mesh, t, 0),
                             f = place_of(made.mesh, t, 2) - place_of(made.mesh, t, 0);
            if (std::abs(e.x * f.y - e.y * f.x) * 1024 * 1024 < 100) continue;  // shares its texels with others
            ++compared;
            worst = std::max(worst, glm::length(expected - (after.x * across + after.y * up + after.z * n)));
            most_bent = std::max(most_bent, glm::length(expected - n));
        }
        EXPECT_GT(compared, 1000u);
        EXPECT_GT(most_bent, 0.25);
        EXPECT_LT(worst, 0.03);
    }
}

TEST(OldLooks, TexturesOfTheSecondSetAreBakedLikeThoseOfTheFirst) {
    TriMesh first = bent_everywhere(fixtures::repaired(Shape::torus, 600));
    Material& m = first.material_table[0];
    m.emission = {1, 1, 1};
    m.occlusion_texture.image = m.emission_texture.image = m.metallic_roughness_texture.image = 0;
    TriMesh second = first;
    second.second_uvs = first.uvs;
    for (glm::vec2& uv : second.uvs) uv = {0.5f * uv.y, 0.25f};
    for (Texture* texture : second.material_table[0].textures()) texture->second = texture->there();
    const Unwrapped one = laid_out(first), other = laid_out(second);
    EXPECT_TRUE(other.mesh.second_uvs.empty());
    const BakedTextures expected = bake_textures(first, one, 1, 256), found = bake_textures(second, other, 1, 256);
    for (const Look look : {Look::surface, Look::normals, Look::emission}) {
        ASSERT_EQ(found.of(look).size(), 1u);
        EXPECT_EQ(found.of(look)[0].texels, expected.of(look)[0].texels) << static_cast<int>(look);
    }
}

// The old tangents say what the old texture coordinates say, or are mirrored where the map's green is upside down.
TEST(OldLooks, NormalsAreTurnedFromTheFrameOfTangents) {
    TriMesh mesh = fixtures::with_tangents_of_triangles(bent_everywhere(fixtures::repaired(Shape::torus, 600)), false);
    mesh.tangents.clear();
    const auto normals_of = [&](const TriMesh& of) {
        const Unwrapped made = laid_out(of);
        EXPECT_TRUE(made.mesh.tangents.empty());
        return bake_textures(of, made, 1, 256).of(Look::normals).at(0).texels;
    };
    const auto expected = normals_of(mesh);
    const auto furthest = [&](const TriMesh& of) {
        const auto found = normals_of(of);
        int worst = 0;
        for (size_t i = 0; i < found.size(); ++i) {
            for (int k = 0; k < 3; ++k) worst = std::max(worst, std::abs(found.at(i)[k] - expected.at(i)[k]));
        }
        return worst;
    };
    EXPECT_LE(furthest(fixtures::with_tangents_of_triangles(mesh, false)), 1);
    TriMesh mirrored = fixtures::with_tangents_of_triangles(mesh, true);
    EXPECT_GT(furthest(mirrored), 30);
    fixtures::turn_green_over(mirrored.images[0]);
    EXPECT_LE(furthest(mirrored), 1);
}

TEST(OldLooks, MaterialsBecomeOnePerSquareUnlessTheyAreShownOtherwise) {
    TriMesh source = fixtures::repaired(Shape::rock, 3000);
    source.material_table.resize(5);
    source.material_table[1].metallic = 1;
    source.material_table[2].roughness = 0.5f;
    source.material_table[3].double_sided = true;
    source.material_table[4].normal_texture.image = 0;  // which nothing of the mesh has
    source.images = {checker({0, 0, 0, 255}, {255, 255, 255, 255})};
    source.uvs.assign(source.wedge_count(), glm::vec2(0));
    source.materials.assign(source.wedge_count(), 0);
    for (size_t w = 0; w < source.wedge_count(); ++w) source.materials[w] = static_cast<uint16_t>(w % 4);
    // A triangle has one material: wedges of its own.
    TriMesh split = source;
    split.wedge_vertex.clear();
    split.materials.clear();
    split.normals.clear();
    split.uvs.clear();
    for (size_t t = 0; t < source.triangle_count(); ++t) {
        for (int k = 0; k < 3; ++k) {
            split.triangles[t][static_cast<size_t>(k)] = static_cast<uint32_t>(split.wedge_vertex.size());
            split.wedge_vertex.push_back(source.vertex_of(t, k));
            split.materials.push_back(static_cast<uint16_t>(t % 4));
            split.uvs.emplace_back(0);
        }
    }
    Unwrapped made = laid_out(split, 2);
    for (const Material& m : made.mesh.material_table) EXPECT_FALSE(m.normal_texture.there());
    BakedTextures baked = bake_textures(split, made, 2, 64);
    EXPECT_TRUE(baked.metal);
    EXPECT_FALSE(baked.occlusion);
    EXPECT_TRUE(baked.of(Look::normals).empty());
    EXPECT_TRUE(baked.of(Look::emission).empty());
    use_textures(made.mesh, std::move(baked), split.material_table);
    EXPECT_TRUE(made.mesh.validate());
    EXPECT_EQ(made.mesh.images.size(), 4u);
    ASSERT_EQ(made.mesh.material_table.size(), 4u);  // of two squares, single- and double-sided
    for (const Material& m : made.mesh.material_table) {
        EXPECT_EQ(m.metallic, 1);
        EXPECT_EQ(m.roughness, 1);
        EXPECT_EQ(m.metallic_roughness_texture.image, m.base_colour_texture.image + 2);
        EXPECT_FALSE(m.occlusion_texture.there());
    }
}

TEST(OldLooks, WithoutBakingTexturesAreGone) {
    Material m;
    m.shading = Shading::metallic_roughness;
    m.metallic = 1;
    m.emission = {1, 1, 1};
    for (Texture* texture : m.textures()) texture->image = 0;
    const Unwrapped made = laid_out(square(m, {checker({0, 0, 0, 255}, {255, 255, 255, 255})}));
    ASSERT_EQ(made.mesh.material_table.size(), 1u);
    for (const Texture* texture : made.mesh.material_table[0].textures()) EXPECT_FALSE(texture->there());
    EXPECT_EQ(made.mesh.material_table[0].metallic, 0);
    EXPECT_EQ(made.mesh.material_table[0].emission, glm::vec3(0));
}

}  // namespace
}  // namespace lodestone::vgi
