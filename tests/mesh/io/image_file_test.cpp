#include "mesh/io/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace lodestone {
namespace {

Image noise(uint32_t width, uint32_t height, bool alpha) {
    std::mt19937 random(width);
    Image image{width, height, {}};
    for (uint32_t i = 0; i < width * height; ++i)
        image.texels.emplace_back(random() % 256, random() % 256, random() % 256, alpha ? random() % 256 : 255);
    return image;
}

TEST(Png, ComesBackAsItWas) {
    for (const auto& [width, height] : {std::pair(1u, 1u), {257u, 3u}, {1u, 300u}, {64u, 64u}}) {
        for (const bool alpha : {false, true}) {
            const Image image = noise(width, height, alpha);
            const auto bytes = encode_png(image);
            ASSERT_TRUE(bytes);
            const auto read = decode_image(*bytes, "a.png");
            ASSERT_TRUE(read) << read.error().message;
            EXPECT_EQ(read->width, width);
            EXPECT_EQ(read->height, height);
            EXPECT_EQ(read->texels, image.texels);
        }
    }
}

// Kind of colour: 2 is three channels, 6 four.
TEST(Png, HasAlphaWhereTheImageHas) {
    const auto with = encode_png(noise(64, 64, true)), without = encode_png(noise(64, 64, false));
    ASSERT_TRUE(with && without);
    EXPECT_EQ((*with)[25], std::byte{6});
    EXPECT_EQ((*without)[25], std::byte{2});
    EXPECT_LT(without->size(), with->size() * 4 / 5);
}

TEST(Png, IsRefusedWhereThereIsNone) {
    EXPECT_THAT(encode_png(Image{}).error().message, testing::HasSubstr("no texels"));
    EXPECT_THAT(encode_png(noise(1 << 21, 1, false)).error().message, testing::HasSubstr("PNG"));
}

}  // namespace
}  // namespace lodestone
