#include "report/image_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace lodestone {
namespace {

Picture flat(uint32_t width, uint32_t height, uint8_t grey, uint8_t alpha = 255) {
    Picture p{width, height, {}, {}};
    for (uint32_t i = 0; i < width * height; ++i) p.colour.insert(p.colour.end(), {grey, grey, grey, alpha});
    p.depth.assign(width * height, 0.5f);
    return p;
}

TEST(Psnr, OfAUniformDifferenceIsItsFormula) {
    const Picture a = flat(20, 10, 100), b = flat(20, 10, 110);
    const auto mask = covered_union(a, b);
    EXPECT_NEAR(psnr_db(a, b, mask), 20 * std::log10(255.0 / 10), 1e-9);
    EXPECT_EQ(psnr_db(a, a, mask), most_psnr_db);
}

TEST(Psnr, LooksOnlyAtWhatIsCovered) {
    Picture a = flat(20, 10, 100), b = flat(20, 10, 100);
    for (size_t i = 0; i < 100; ++i) a.colour[4 * i + 3] = b.colour[4 * i + 3] = 0;
    b.colour[0] = 255;  // not covered
    EXPECT_EQ(psnr_db(a, b, covered_union(a, b)), most_psnr_db);
    b.colour[3] = 1;
    EXPECT_LT(psnr_db(a, b, covered_union(a, b)), 60);
}

TEST(Ssim, IsOneForEqualPicturesAndFallsWithNoise) {
    Picture a = flat(32, 32, 128);
    for (size_t i = 0; i < a.colour.size(); i += 4)
        a.colour[i] = a.colour[i + 1] = a.colour[i + 2] = static_cast<uint8_t>(i * 7 % 200);
    Picture slightly = a, strongly = a;
    for (size_t i = 0; i < a.colour.size(); i += 8) {
        slightly.colour[i + 1] ^= 4;
        strongly.colour[i + 1] ^= 127;
    }
    const auto mask = covered_union(a, a);
    EXPECT_NEAR(ssim(a, a, mask), 1, 1e-12);
    EXPECT_GT(ssim(a, slightly, mask), ssim(a, strongly, mask));
    EXPECT_LT(ssim(a, strongly, mask), 0.9);
}

TEST(BackgroundLeaks, CountsHolesAndNotTheOutline) {
    Picture full = flat(20, 20, 10, 0), shown = full;
    for (uint32_t y = 4; y < 16; ++y) {
        for (uint32_t x = 4; x < 16; ++x) full.colour[4 * (y * 20 + x) + 3] = shown.colour[4 * (y * 20 + x) + 3] = 255;
    }
    EXPECT_EQ(background_leaks(shown, full, 0), 0u);
    shown.colour[4 * (10 * 20 + 10) + 3] = 0;  // a hole
    shown.colour[4 * (4 * 20 + 4) + 3] = 0;    // a corner of the outline
    EXPECT_EQ(background_leaks(shown, full, 0), 1u);
    // An outline that may be off by more is no hole so much farther inside.
    shown.colour[4 * (7 * 20 + 10) + 3] = 0;  // three pixels from it
    EXPECT_EQ(background_leaks(shown, full, 0), 2u);
    EXPECT_EQ(background_leaks(shown, full, 1), 2u);
    EXPECT_EQ(background_leaks(shown, full, 1.5), 1u);
    EXPECT_EQ(background_leaks(shown, full, 1e9), 0u);
}

// A square that ends in the middle of the picture, and a wall behind it that begins there or a little behind it.
TEST(Cracks, AreNoneWhereOnePartEndsInFrontOfAnother) {
    Camera camera;
    camera.eye = {0, 0, 5};
    const View view = view_of(camera, 64, 64);
    const std::vector<glm::vec3> positions = {{-9, -9, 0},  {0, -9, 0},  {0, 9, 0},  {-9, 9, 0},
                                              {-1, -9, -2}, {9, -9, -2}, {9, 9, -2}, {-1, 9, -2}};
    const std::vector<uint32_t> indices = {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
    const ClosestSurface surface(positions, indices);
    Picture full = flat(64, 64, 100);
    for (uint32_t i = 0; i < 64 * 64; ++i) {
        const glm::vec4 clip = view.world_to_clip() * glm::vec4(0, 0, i % 64 < 32 ? 0 : -2, 1);
        full.depth[i] = clip.z / clip.w;
    }
    const auto with_hole_at = [&](uint32_t x) {
        Picture shown = full;
        shown.colour[4 * (20 * 64 + x) + 3] = 0;
        return shown;
    };
    const auto found = [&](uint32_t x, double pixel_error) {
        return cracks(with_hole_at(x), full, surface, nullptr, view, pixel_error);
    };
    for (const uint32_t x : {20u, 29u, 34u, 50u}) EXPECT_EQ(found(x, 0), 1u) << x;
    for (const uint32_t x : {30u, 31u, 32u, 33u}) EXPECT_EQ(found(x, 0), 0u) << x;
    EXPECT_EQ(found(29, 1), 0u);
    EXPECT_EQ(background_leaks(with_hole_at(31), full, 0), 1u);
    EXPECT_EQ(cracks(full, full, surface, nullptr, view, 0), 0u);
}

std::vector<glm::vec3> corners_of(const std::vector<glm::vec3>& positions, const std::vector<uint32_t>& indices) {
    std::vector<glm::vec3> corners;
    for (const uint32_t i : indices) corners.push_back(positions[i]);
    return corners;
}

TEST(Rims, AreTheEdgesOfOneTriangleAlone) {
    const std::vector<glm::vec3> positions = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {2, 2, 4}};
    const auto square = rims_of(corners_of(positions, {0, 1, 2, 0, 2, 3}));
    ASSERT_NE(square, nullptr);
    EXPECT_NEAR(square->closest({2, 2, 0}).distance, 2, 1e-6);  // not the diagonal
    EXPECT_NEAR(square->closest({2, -1, 0}).distance, 1, 1e-6);
    EXPECT_EQ(rims_of(corners_of(positions, {0, 2, 1, 0, 3, 2, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4})), nullptr);
    EXPECT_EQ(rims_of({}), nullptr);
}

// A slit narrower than a pixel between two parts of a wall, which no pixel of `full` shows.
TEST(Cracks, AreNoneWhereTheSurfaceEnds) {
    Camera camera;
    camera.eye = {0, 0, 5};
    const View view = view_of(camera, 64, 64);
    const std::vector<glm::vec3> positions = {{-9, -9, 0},    {0, -9, 0}, {0, 9, 0}, {-9, 9, 0},
                                              {1e-3f, -9, 0}, {9, -9, 0}, {9, 9, 0}, {1e-3f, 9, 0}};
    const std::vector<uint32_t> indices = {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
    const ClosestSurface surface(positions, indices);
    const auto rims = rims_of(corners_of(positions, indices));
    Picture full = flat(64, 64, 100);
    const glm::vec4 clip = view.world_to_clip() * glm::vec4(0, 0, 0, 1);
    std::ranges::fill(full.depth, clip.z / clip.w);
    Picture shown = full;
    for (const uint32_t x : {15u, 31u, 48u}) shown.colour[4 * (20 * 64 + x) + 3] = 0;
    EXPECT_EQ(cracks(shown, full, surface, nullptr, view, 0), 3u);
    EXPECT_EQ(cracks(shown, full, surface, rims.get(), view, 0), 2u);
}

// However steeply it is seen, one surface is one sheet.
TEST(Cracks, AreFoundInASteepSurface) {
    Camera camera;
    camera.eye = {0, 0.2f, 5};
    camera.target = {0, 0.2f, 0};
    const View view = view_of(camera, 64, 64);
    const std::vector<glm::vec3> positions = {{-99, 0, 5}, {99, 0, 5}, {99, 0, -99}, {-99, 0, -99}};
    const std::vector<uint32_t> indices = {0, 1, 2, 0, 2, 3};
    const ClosestSurface surface(positions, indices);
    Picture full = flat(64, 64, 100, 0);
    for (uint32_t y = 0; y < 64; ++y) {
        const float down = (static_cast<float>(y) + 0.5f - 32) / view.focal_px, z = 5 - 0.2f / down;
        if (down <= 0 || z < -99) continue;
        const glm::vec4 clip = view.world_to_clip() * glm::vec4(0, 0, z, 1);
        for (uint32_t x = 0; x < 64; ++x) {
            full.colour[4 * (64 * y + x) + 3] = 255;
            full.depth[64 * y + x] = clip.z / clip.w;
        }
    }
    Picture shown = full;
    for (const uint32_t y : {36u, 50u}) shown.colour[4 * (64 * y + 30) + 3] = 0;
    EXPECT_EQ(cracks(shown, full, surface, nullptr, view, 0), 2u);
}

TEST(Downsampled, AveragesInLinearLight) {
    Picture p = flat(4, 4, 0);
    for (size_t i = 0; i < 8; ++i) p.colour[4 * i] = p.colour[4 * i + 1] = p.colour[4 * i + 2] = 255;
    const Picture small = downsampled(p, 4);
    EXPECT_EQ(small.width, 1u);
    EXPECT_NEAR(small.colour[0], 188, 1);  // half the light
    EXPECT_EQ(small.colour[3], 255);
}

// A square facing the camera at distance 5, and one further back by `gap`.
TEST(MaxPixelDeviation, OfAMovedSquareIsTheMoveInPixels) {
    Camera camera;
    camera.eye = {0, 0, 5};
    const View view = view_of(camera, 64, 64);
    const auto square = [](float z) { return std::vector<glm::vec3>{{-9, -9, z}, {9, -9, z}, {9, 9, z}, {-9, 9, z}}; };
    const std::vector<uint32_t> indices = {0, 1, 2, 0, 2, 3};
    const auto picture_at = [&](float z) {
        Picture p = flat(64, 64, 100);
        const glm::vec4 clip = view.world_to_clip() * glm::vec4(0, 0, z, 1);
        p.depth.assign(64 * 64, clip.z / clip.w);
        return p;
    };
    const ClosestSurface near(square(0), indices), far(square(-0.1f), indices);
    const double deviation = max_pixel_deviation(picture_at(-0.1f), far, picture_at(0), near, view);
    EXPECT_NEAR(deviation, 0.1 * static_cast<double>(view.focal_px) / 5, 0.02);
    // One pixel whose depth is that of no point of what is drawn.
    Picture astray = picture_at(-0.1f);
    astray.depth[64 * 32 + 32] = picture_at(-1.0f).depth[0];
    EXPECT_NEAR(max_pixel_deviation(astray, far, picture_at(0), near, view), deviation, 0.02);
}

TEST(DifferenceMap, IsBlackWhereNothingDiffersAndBrightWhereMuchDoes) {
    Picture a = flat(3, 1, 100), b = flat(3, 1, 100);
    for (int k = 0; k < 3; ++k) b.colour[static_cast<size_t>(k)] = 200;
    a.colour[4 * 2 + 3] = b.colour[4 * 2 + 3] = 0;  // covered by neither
    const Picture map = difference_map(a, b);
    const auto texel = [&](size_t i) {
        return std::vector<uint8_t>(map.colour.begin() + static_cast<ptrdiff_t>(4 * i),
                                    map.colour.begin() + static_cast<ptrdiff_t>(4 * i + 3));
    };
    EXPECT_EQ(texel(0), (std::vector<uint8_t>{255, 255, 255}));
    EXPECT_EQ(texel(1), (std::vector<uint8_t>{0, 0, 0}));
    EXPECT_EQ(texel(2), (std::vector<uint8_t>{12, 16, 28}));
}

}  // namespace
}  // namespace lodestone
