#include "report/thumbnail.h"

#include <gtest/gtest.h>

#include <limits>

#include "mesh/generate.h"

namespace lodestone {
namespace {

TEST(Thumbnail, ShowsTheMeshInTheMiddleAndNothingInTheCorners) {
    const Image picture = thumbnail_of(generate(Shape::sphere, 2000, 1));
    ASSERT_EQ(picture.texels.size(), size_t{96} * 72);
    EXPECT_EQ(picture.texels.front().a, 0);
    EXPECT_EQ(picture.texels.back().a, 0);
    const auto& middle = picture.texels[size_t{36} * 96 + 48];
    EXPECT_EQ(middle.a, 255);
    EXPECT_GT(middle.r, 200) << "what looks at the eye is bright";
    size_t covered = 0;
    for (const auto& texel : picture.texels) covered += texel.a > 0 ? 1 : 0;
    // A disc of 0.95 of the height.
    EXPECT_NEAR(static_cast<double>(covered), 3.14159 * 34.2 * 34.2, 150);
}

TEST(Thumbnail, TakesWhateverMeshesHold) {
    TriMesh mesh;
    EXPECT_EQ(thumbnail_of(mesh).texels.size(), size_t{96} * 72);
    const float huge = std::numeric_limits<float>::max();
    mesh.positions = {{0, 0, 0}, {huge, 0, 0}, {0, huge, huge}, {0, 0, 0}};
    mesh.set_identity_wedges();
    mesh.triangles = {{0, 1, 2}, {0, 3, 0}, {1, 2, 3}};
    EXPECT_EQ(thumbnail_of(mesh, 8, 8).texels.size(), 64u);
}

}  // namespace
}  // namespace lodestone
