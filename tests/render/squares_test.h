// Flat squares with materials, drawn by the device and computed by the CPU (material_reference.h).
#pragma once

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "baseline/fixed_levels.h"
#include "baseline/full.h"
#include "mesh/packed_vertices.h"
#include "mesh/tri_mesh.h"
#include "render/device_test.h"
#include "render/material_reference.h"
#include "report/image_metrics.h"

namespace lodestone {

// Squares as a mesh, of 8 x 8 quads each.
inline TriMesh mesh_of(const std::vector<LookedAtSquare>& squares, size_t materials) {
    TriMesh mesh;
    mesh.material_table.resize(materials);
    constexpr uint32_t side = 8;
    for (const LookedAtSquare& square : squares) {
        const auto first = static_cast<uint32_t>(mesh.positions.size());
        for (uint32_t i = 0; i < (side + 1) * (side + 1); ++i) {
            const glm::vec2 at = glm::vec2(i % (side + 1), i / (side + 1)) / static_cast<float>(side);
            mesh.positions.emplace_back((square.turned ? 1 - 2 * at.x : 2 * at.x - 1), 1 - 2 * at.y, square.height);
            mesh.normals.emplace_back(0, 0, square.turned ? -1 : 1);
            mesh.uvs.push_back(square.uv_low + (square.uv_high - square.uv_low) * at);
            mesh.second_uvs.push_back(square.second_low +
                                      (square.second_high - square.second_low) * glm::vec2(at.y, at.x));
            mesh.tangents.push_back(square.tangent);
            mesh.materials.push_back(static_cast<uint16_t>(square.material));
        }
        for (uint32_t q = 0; q < side * side; ++q) {
            const uint32_t a = first + q / side * (side + 1) + q % side, b = a + 1, c = a + side + 1, d = c + 1;
            mesh.triangles.push_back({a, c, b});
            mesh.triangles.push_back({b, c, d});
        }
    }
    mesh.set_identity_wedges();
    return mesh;
}

inline Image image_of(uint32_t columns, uint32_t rows, uint64_t seed) {
    Image image{columns, rows, {}};
    Random random(seed);
    for (uint32_t i = 0; i < columns * rows; ++i) {
        const auto byte = [&] { return static_cast<uint8_t>(random.below(256)); };
        image.texels.emplace_back(byte(), byte(), byte(), byte());
    }
    return image;
}

// Directions around straight up, as maps of normals hold them.
inline Image normals_of(uint32_t columns, uint32_t rows, uint64_t seed) {
    Image image = image_of(columns, rows, seed);
    for (glm::u8vec4& t : image.texels) {
        const glm::vec3 n = glm::normalize(glm::vec3(glm::vec2(t) / 255.0f - 0.5f, 0.7f));
        t = glm::u8vec4(glm::round((n * 0.5f + 0.5f) * 255.0f), 255);
    }
    return image;
}

class SquaresTest : public DeviceTest {
protected:
    SquaresTest(uint32_t width, uint32_t height) : DeviceTest(width, height) {
        camera_.eye = {0.4f, 0.3f, 2.6f};
        camera_.target = {0.05f, -0.05f, 0};
        look_.light_direction = {-0.25f, -0.35f, -1};
        set_.materials.resize(1);
        first().shading = Shading::metallic_roughness;
        first().base_colour = {0.8f, 0.5f, 0.3f, 1};
        first().roughness = 0.45f;
    }
    Material& first() { return set_.materials[0]; }
    void add_texture(Texture& texture, Image image) {
        texture.image = static_cast<int32_t>(set_.images.size());
        set_.images.push_back(std::move(image));
    }

    Picture drawn(const std::vector<LookedAtSquare>& squares) {
        TriMesh mesh = mesh_of(squares, set_.materials.size());
        if (!use_second_set(set_.materials)) mesh.second_uvs.clear();
        if (std::ranges::all_of(squares, [](const auto& s) { return s.tangent.w == 0; })) mesh.tangents.clear();
        return drawn(mesh, set_);
    }
    Picture drawn(const TriMesh& mesh, const MaterialSet& set, const Instance& instance = {}) {
        std::vector<uint32_t> indices;
        for (const Triangle& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
        auto source =
            open_fixed_levels({full_level(pack_vertices(mesh), indices, pack_further(mesh))}, uint64_t{1} << 26);
        EXPECT_TRUE(source);
        if (renderer_ == nullptr) make();
        EXPECT_TRUE(renderer_->load((*source)->recipe(), set));
        FrameInput input;
        input.views = {view_of(camera_, width_, height_)};
        input.instances = {instance};
        EXPECT_TRUE(renderer_->submit((*source)->plan(input), input, look_));
        auto picture = renderer_->read_picture();
        EXPECT_TRUE(picture);
        return std::move(*picture);
    }
    double against_reference(const std::vector<LookedAtSquare>& squares) {
        return against_reference(drawn(squares), squares);
    }
    double against_reference(const Picture& picture, const std::vector<LookedAtSquare>& squares) {
        const Picture reference = reference_picture(squares, set_, camera_, width_, height_, look_, around_);
        return against_reference(picture, reference, covered_union(picture, reference));
    }
    // mask: of the pixels to compare, 1.
    double against_reference(const Picture& picture, const Picture& reference, const std::vector<uint8_t>& mask) {
        EXPECT_GT(std::count(mask.begin(), mask.end(), 1), width_ * height_ / 9);
        const double psnr = psnr_db(picture, reference, mask);
        RecordProperty("psnr_db", std::to_string(psnr));
        return psnr;
    }

    MaterialSet set_;
    Surroundings around_;  // of the reference; what the device has of them is in set_
    Camera camera_;
    ShadingOptions look_;
};

}  // namespace lodestone
