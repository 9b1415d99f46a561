// Every feature of materials as the device draws it, against what the CPU computes by itself (material_reference.h).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "base/looks/srgb.h"
#include "fixtures/written_glbs.h"
#include "mesh/io/read.h"
#include "mesh/io/write.h"
#include "render/squares_test.h"

namespace lodestone {
namespace {

constexpr uint32_t shown_width = 240, shown_height = 180;

class MaterialsTest : public SquaresTest {
protected:
    MaterialsTest() : SquaresTest(shown_width, shown_height) {}
};

TEST_F(MaterialsTest, MetalAndRoughness) {
    for (const float roughness : {0.2f, 0.5f, 1.0f}) {
        for (const float metallic : {0.0f, 1.0f}) {
            first().metallic = metallic;
            first().roughness = roughness;
            EXPECT_GT(against_reference({{}}), 50) << metallic << ", " << roughness;
        }
    }
}

TEST_F(MaterialsTest, MapsOfMetalAndRoughness) {
    add_texture(first().metallic_roughness_texture, image_of(24, 10, 1));
    first().metallic = 0.9f;
    first().roughness = 0.8f;
    EXPECT_GT(against_reference({{}}), 50);
}

TEST_F(MaterialsTest, MapsOfNormals) {
    add_texture(first().normal_texture, normals_of(20, 20, 2));
    first().normal_scale = 0.7f;
    EXPECT_GT(against_reference({{}}), 50);
    // Its green points up whichever way texture coordinates run.
    EXPECT_GT(against_reference({{.uv_low = {1, 0}, .uv_high = {0, 1}}}), 50);
    EXPECT_GT(against_reference({{.uv_low = {0.1f, 0.9f}, .uv_high = {0.8f, 0.2f}}}), 50);
}

// Which are not what texture coordinates tell: a quarter of a turn, mirrored, slanting and not upright to the normal.
constexpr glm::vec4 odd_tangents[] = {{0, 1, 0, 1}, {0, 1, 0, -1}, {-1, 0, 0, 1}, {0.48f, 0.6f, 0.64f, -1}};

TEST_F(MaterialsTest, MapsOfNormalsAreInTheFrameOfTangents) {
    add_texture(first().normal_texture, normals_of(20, 20, 2));
    const Picture without = drawn({{}});
    for (const glm::vec4& tangent : odd_tangents) {
        EXPECT_GT(against_reference({{.tangent = tangent}}), 50);
        EXPECT_LT(psnr_db(without, drawn({{.tangent = tangent}}), covered_union(without, without)), 30);
        // Beside a square that has none.
        EXPECT_GT(against_reference({{.tangent = tangent}, {.height = -1, .uv_low = {0.2f, 0.9f}}}), 50);
    }
    // They are not turned with the texture.
    const float turn = 0.6f;
    first().normal_texture.place = {
        {0.8f * std::cos(turn), -0.8f * std::sin(turn)}, {0.8f * std::sin(turn), 0.8f * std::cos(turn)}, {0.1f, 0.6f}};
    EXPECT_GT(against_reference({{.tangent = odd_tangents[0]}}), 50);
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

TEST_F(MaterialsTest, TangentsSeenFromBehind) {
    add_texture(first().normal_texture, normals_of(20, 20, 2));
    first().double_sided = true;
    for (const glm::vec4& tangent : odd_tangents)
        EXPECT_GT(against_reference({{.turned = true, .tangent = tangent}}), 50);
}

// Of an instance that is mirrored from left to right the bitangent is, too.
TEST_F(MaterialsTest, TangentsOfWhatIsMirrored) {
    add_texture(first().normal_texture, normals_of(20, 20, 2));
    set_.mirrors = true;
    Instance instance;
    instance.object_to_world[0].x = -1;
    for (const glm::vec4& t : odd_tangents) {
        const TriMesh mesh = mesh_of({{.tangent = t}}, 1);
        const LookedAtSquare shown{.uv_low = {1, 0}, .uv_high = {0, 1}, .tangent = {-t.x, t.y, t.z, -t.w}};
        EXPECT_GT(against_reference(drawn(mesh, set_, instance), {shown}), 50);
    }
}

TEST_F(MaterialsTest, OcclusionLeavesTheLightAlone) {
    add_texture(first().occlusion_texture, image_of(16, 16, 3));
    first().occlusion_strength = 0.8f;
    EXPECT_GT(against_reference({{}}), 50);
}

TEST_F(MaterialsTest, Emission) {
    add_texture(first().emission_texture, image_of(16, 12, 4));
    first().emission = {0.5f, 0.2f, 0.9f};
    EXPECT_GT(against_reference({{}}), 50);
}

TEST_F(MaterialsTest, PlainMaterialsShineToo) {
    first().shading = Shading::plain;
    first().base_colour = {0, 0, 0, 1};
    first().emission = {0.5f, 0.2f, 0.9f};
    look_.light_direction = {0, 0, 1};
    const Picture picture = drawn({{}});
    const size_t centre = 4 * (size_t{shown_height / 2} * shown_width + shown_width / 2);
    for (int k = 0; k < 3; ++k) {
        const double shown = 255 * srgb_from_linear(static_cast<double>(first().emission[k]));
        EXPECT_NEAR(picture.colour[centre + static_cast<size_t>(k)], shown, 1) << k;
    }
}

TEST_F(MaterialsTest, Unlit) {
    add_texture(first().base_colour_texture, image_of(16, 12, 5));
    first().shading = Shading::unlit;
    EXPECT_GT(against_reference({{}}), 50);
}

TEST_F(MaterialsTest, TexturesMovedAndTurned) {
    add_texture(first().base_colour_texture, image_of(12, 12, 6));
    add_texture(first().normal_texture, normals_of(12, 12, 7));
    const float turn = 0.6f;
    first().base_colour_texture.place = {{0.7f, 0.1f}, {-0.2f, 0.5f}, {0.3f, 0.4f}};
    first().normal_texture.place = {
        {0.8f * std::cos(turn), -0.8f * std::sin(turn)}, {0.8f * std::sin(turn), 0.8f * std::cos(turn)}, {0.1f, 0.6f}};
    EXPECT_GT(against_reference({{}}), 50);
}

// A square whose second texture coordinates run another way than the first, by another scale.
constexpr LookedAtSquare of_two_sets{
    .uv_low = {0.1f, 0.2f}, .uv_high = {0.9f, 1.3f}, .second_low = {1.2f, 0.1f}, .second_high = {0.3f, 0.8f}};

TEST_F(MaterialsTest, TexturesOfTheSecondSet) {
    add_texture(first().base_colour_texture, image_of(12, 12, 31));
    for (const size_t k : {1, 2, 3, 4}) {
        Material alone = first();
        add_texture(*first().textures()[k], k == 2 ? normals_of(16, 16, 32) : image_of(14, 18, 30 + k));
        first().metallic = 0.8f;
        first().emission = {0.3f, 0.4f, 0.2f};
        const double same_set = against_reference({of_two_sets});
        const Picture of_first = drawn({of_two_sets});
        first().textures()[k]->second = true;
        EXPECT_GT(same_set, 50) << k;
        EXPECT_GT(against_reference({of_two_sets}), 50) << k;
        const auto mask = covered_union(of_first, of_first);
        EXPECT_LT(psnr_db(of_first, drawn({of_two_sets}), mask), 45) << k << ": the sets differ";
        first() = alone;
    }
    EXPECT_THAT(renderer_->validation_messages(), testing::IsEmpty());
}

TEST_F(MaterialsTest, TexturesOfTheSecondSetMovedAndTurned) {
    add_texture(first().base_colour_texture, image_of(12, 12, 41));
    add_texture(first().normal_texture, normals_of(12, 12, 42));
    add_texture(first().occlusion_texture, image_of(12, 12, 43));
    const float turn = -0.9f;
    first().normal_texture.second = first().occlusion_texture.second = true;
    first().normal_texture.place = {
        {0.8f * std::cos(turn), -0.8f * std::sin(turn)}, {0.7f * std::sin(turn), 0.7f * std::cos(turn)}, {0.1f, 0.6f}};
    first().occlusion_texture.place = {{-0.5f, 0}, {0, 0.7f}, {0.3f, 0.2f}};
    first().occlusion_texture.wrap = {Wrap::mirror, Wrap::clamp};
    EXPECT_GT(against_reference({of_two_sets}), 50);
    // From behind, too.
    first().double_sided = true;
    LookedAtSquare turned = of_two_sets;
    turned.turned = true;
    EXPECT_GT(against_reference({turned}), 50);
}

TEST_F(MaterialsTest, TangentsBesideASecondSet) {
    add_texture(first().base_colour_texture, image_of(12, 12, 31));
    add_texture(first().normal_texture, normals_of(20, 20, 2));
    first().normal_texture.second = true;
    LookedAtSquare square = of_two_sets;
    for (const glm::vec4& tangent : odd_tangents) {
        square.tangent = tangent;
        EXPECT_GT(against_reference({square}), 50);
    }
}

// A GLB with them, read back.
TEST_F(MaterialsTest, TexturesOfTheSecondSetAndTangentsOfAFile) {
    for (Texture* texture : first().textures()) texture->second = texture != &first().base_colour_texture;
    add_texture(first().base_colour_texture, image_of(12, 12, 51));
    add_texture(first().normal_texture, normals_of(12, 12, 53));
    add_texture(first().occlusion_texture, image_of(12, 12, 54));
    add_texture(first().emission_texture, image_of(12, 12, 55));
    for (Image& image : set_.images) {
        for (glm::u8vec4& texel : image.texels) texel.w = 255;
    }
    first().emission = {0.3f, 0.4f, 0.2f};
    first().normal_texture.place = {{0, -0.8f}, {0.8f, 0}, {0.1f, 0.6f}};
    LookedAtSquare square = of_two_sets;
    square.tangent = odd_tangents[3];
    TriMesh mesh = mesh_of({square}, 0);
    mesh.material_table = set_.materials;
    mesh.images = set_.images;
    const auto path =
        std::filesystem::temp_directory_path() / ("lodestone_two_sets_" + std::to_string(::getpid()) + ".glb");
    ASSERT_TRUE(write_mesh(mesh, path));
    ReadReport told;
    const auto read = read_mesh(path, {}, &told);
    fixtures::WrittenGlbs written;
    written.keep(path);
    written.check();
    std::filesystem::remove(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(told.warnings.empty());
    EXPECT_EQ(read->tangents.size(), read->wedge_count());
    EXPECT_GT(against_reference(drawn(*read, {read->material_table, read->images}), {square}), 50);
}

// What is drawn where a material is on a second set and the mesh has none is not left to chance.
TEST_F(MaterialsTest, WithoutASecondSetItIsZero) {
    add_texture(first().emission_texture, image_of(2, 2, 61));
    first().emission = {1, 1, 1};
    first().emission_texture.second = true;
    const LookedAtSquare square{.second_low = {0, 0}, .second_high = {1e-6f, 1e-6f}};
    TriMesh mesh = mesh_of({square}, set_.materials.size());
    mesh.second_uvs.clear();
    mesh.tangents.clear();
    EXPECT_GT(against_reference(drawn(mesh, set_), {square}), 50);
}

TEST_F(MaterialsTest, TexturesBeyondTheirEdges) {
    add_texture(first().base_colour_texture, image_of(10, 6, 8));
    const LookedAtSquare square{.uv_low = {-0.6f, -0.7f}, .uv_high = {1.8f, 1.5f}};
    for (const Wrap across : {Wrap::repeat, Wrap::clamp, Wrap::mirror}) {
        for (const Wrap down : {Wrap::repeat, Wrap::clamp, Wrap::mirror}) {
            first().base_colour_texture.wrap = {across, down};
            EXPECT_GT(against_reference({square}), 50) << static_cast<int>(across) << ", " << static_cast<int>(down);
        }
    }
}

TEST_F(MaterialsTest, MasksHaveHoles) {
    add_texture(first().base_colour_texture, image_of(14, 14, 9));
    first().alpha_mode = AlphaMode::mask;
    first().alpha_cutoff = 0.4f;
    set_.materials.emplace_back();
    set_.materials[1].shading = Shading::unlit;
    set_.materials[1].base_colour = {0.1f, 0.6f, 0.2f, 1};
    const std::vector<LookedAtSquare> squares{{}, {.height = -0.5f, .material = 1}};
    const Picture picture = drawn(squares);
    const Picture reference = reference_picture(squares, set_, camera_, width_, height_, look_);
    // Devices filter with as few as 8 bits of a weight: at the rims of holes a pixel may fall either way.
    constexpr float either_way = 1.0f / 128;
    auto mask = covered_union(picture, reference);
    size_t left_out = 0;
    for (const float cutoff : {0.4f - either_way, 0.4f + either_way}) {
        first().alpha_cutoff = cutoff;
        const Picture moved = reference_picture(squares, set_, camera_, width_, height_, look_);
        for (size_t i = 0; i < mask.size(); ++i) {
            if (std::equal(&moved.colour[4 * i], &moved.colour[4 * i] + 4, &reference.colour[4 * i])) continue;
            left_out += mask[i];
            mask[i] = 0;
        }
    }
    EXPECT_LT(left_out, mask.size() / 50);
    EXPECT_GT(against_reference(picture, reference, mask), 50);
}

TEST_F(MaterialsTest, BlendsOverWhatLiesBehind) {
    add_texture(first().base_colour_texture, image_of(14, 14, 10));
    first().alpha_mode = AlphaMode::blend;
    first().base_colour.w = 0.8f;
    set_.materials.emplace_back();
    set_.materials[1].shading = Shading::unlit;
    set_.materials[1].base_colour = {0.1f, 0.6f, 0.2f, 1};
    EXPECT_GT(against_reference({{}, {.height = -0.5f, .material = 1}}), 50);
    // What is behind something opaque is not seen.
    EXPECT_GT(against_reference({{}, {.height = 0.2f, .material = 1}}), 50);
}

TEST_F(MaterialsTest, TwoSidesOrOne) {
    set_.materials.push_back(first());
    set_.materials[1].base_colour = {0.2f, 0.4f, 0.9f, 1};
    for (const bool first_two : {false, true}) {
        for (const bool second_two : {false, true}) {
            set_.materials[0].double_sided = first_two;
            set_.materials[1].double_sided = second_two;
            EXPECT_GT(against_reference({{.turned = true}, {.height = -0.5f, .material = 1}}), 50);
            if (!second_two) continue;
            EXPECT_GT(against_reference({{}, {.height = 0.5f, .turned = true, .material = 1}}), 50);
        }
    }
}

// More sizes and kinds than there are arrays of textures.
TEST_F(MaterialsTest, TexturesOfManySizes) {
    std::vector<LookedAtSquare> squares;
    for (uint32_t i = 0; i < 12; ++i) {
        Material material = first();
        material.shading = i % 3 == 0 ? Shading::metallic_roughness : Shading::unlit;
        (i % 3 == 0 ? material.occlusion_texture : material.base_colour_texture).image = static_cast<int32_t>(i);
        set_.images.push_back(image_of(8 + i, 20 - i, 20 + i));
        set_.materials.push_back(material);
    }
    for (uint32_t i = 1; i <= 12; ++i) {
        // Those that are enlarged are filtered twice, so they are blurred.
        EXPECT_GT(against_reference({{.material = i}}), 22) << i;
    }
}

}  // namespace
}  // namespace lodestone
