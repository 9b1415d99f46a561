// Radiance pictures of surroundings: what is read, and what is refused.
#include "light/panorama.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <string>

namespace lodestone {
namespace {

using testing::HasSubstr;

std::string header(const std::string& size, const std::string& lines = "FORMAT=32-bit_rle_rgbe\n") {
    return "#?RADIANCE\n" + lines + "\n" + size + "\n";
}

Result<Panorama> decoded(const std::string& file) {
    return decode_panorama(std::as_bytes(std::span(file.data(), file.size())), "a.hdr");
}

// Row y of a picture 16 texels wide: numbers that differ, and runs.
glm::u8vec4 texel_of(uint32_t x, uint32_t y) {
    return {static_cast<uint8_t>(20 + x * 7 + y), static_cast<uint8_t>(x < 9 ? 50 : 60 + x),
            static_cast<uint8_t>(200 - y), static_cast<uint8_t>(128 + y / 2)};
}
void expect_texels(const std::string& file) {
    const auto read = decoded(file);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->width, 16u);
    ASSERT_EQ(read->texels.size(), 128u);
    for (uint32_t i = 0; i < 128; ++i) EXPECT_EQ(read->texels[i], texel_of(i % 16, i / 16)) << i;
}

std::string packed_picture() {
    std::string file = header("-Y 8 +X 16");
    for (uint32_t y = 0; y < 8; ++y) {
        file += std::string("\2\2\0\20", 4);
        for (int c = 0; c < 4; ++c) {
            for (uint32_t x = 0; x < 16;) {
                uint32_t run = 1;
                while (x + run < 16 && texel_of(x + run, y)[c] == texel_of(x, y)[c]) ++run;
                file += static_cast<char>(run > 1 ? 128 + run : 1);
                file += static_cast<char>(texel_of(x, y)[c]);
                x += run;
            }
        }
    }
    return file;
}

TEST(Panorama, ReadsFlatRows) {
    std::string file = header("-Y 8 +X 16", "# by hand\nFORMAT=32-bit_rle_rgbe\nSOFTWARE=none\n");
    for (uint32_t i = 0; i < 128; ++i) {
        for (int c = 0; c < 4; ++c) file += static_cast<char>(texel_of(i % 16, i / 16)[c]);
    }
    expect_texels(file);
}

TEST(Panorama, ReadsRunsByComponent) { expect_texels(packed_picture()); }

TEST(Panorama, ReadsRunsOfTexels) {
    // 300 = 44 + (1 << 8) repeats and the first.
    std::string file = header("-Y 301 +X 602");
    for (int y = 0; y < 301; ++y) {
        file += "\x0a\x14\x1e\x80";
        file += std::string("\1\1\1\x2c\1\1\1\1", 8);
        file += "\x28\x14\x1e\x80";
        file += std::string("\1\1\1\x2c\1\1\1\1", 8);
    }
    const auto read = decoded(file);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->texels[300], glm::u8vec4(10, 20, 30, 128));
    EXPECT_EQ(read->texels[301], glm::u8vec4(40, 20, 30, 128));
    EXPECT_EQ(read->texels[602 * 300 + 601], glm::u8vec4(40, 20, 30, 128));
}

TEST(Panorama, NumbersAreRadiance) {
    // Ward: (mantissa + 1/2) / 256 times two to the exponent, less 128; over the exposures.
    const auto read =
        decoded(header("-Y 1 +X 2", "EXPOSURE=2\nEXPOSURE= 4.0\n") + std::string("\x7f\0\xff\x82\0\0\0\0", 8));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->at(0, 0), glm::vec3(127.5f, 0.5f, 255.5f) * (4.0f / 256 / 8));
    EXPECT_EQ(read->at(1, 0), glm::vec3(0));
}

TEST(Panorama, IsLookedUpByDirection) {
    Panorama picture{64, 32, {}, 1};
    for (uint32_t y = 0; y < 32; ++y) {
        for (uint32_t x = 0; x < 64; ++x)
            picture.texels.emplace_back(static_cast<uint8_t>(2 * x), static_cast<uint8_t>(4 * y), uint8_t{0},
                                        uint8_t{136});
    }
    const auto seen = [&](const glm::vec3& d) { return picture.towards(glm::normalize(d)); };
    // Column and row, which texels hold doubled and fourfold.
    const auto is_at = [&](const glm::vec3& d, float column, float row) {
        EXPECT_NEAR(seen(d).x, 2 * (column - 0.5f) + 0.5f, 0.01f);
        EXPECT_NEAR(seen(d).y, 4 * (row - 0.5f) + 0.5f, 0.01f);
    };
    is_at({0, 0, -1}, 32, 16);
    is_at({1, 0, 0}, 48, 16);
    is_at({-1, 0, 0}, 16, 16);
    is_at({-0.2f, 1, -0.2f * std::sqrt(3.0f)}, 64.0f * 150 / 360, 32 * std::atan(0.4f) / 3.14159f);
    // Behind, the first and the last column meet.
    EXPECT_NEAR(seen({0, 0, 1}).x, 63.5f, 0.01f);
    // Nothing lies above the top row.
    EXPECT_NEAR(seen({0, 1, 0}).y, 0.5f, 0.01f);
}

TEST(Panorama, WhatCannotBeReadIsRefusedByALine) {
    const auto refused = [](const std::string& file, const std::string& why) {
        const auto read = decoded(file);
        ASSERT_FALSE(read) << why;
        EXPECT_EQ(read.error().fault, Fault::format);
        EXPECT_THAT(read.error().message, testing::AllOf(testing::StartsWith("a.hdr: "), HasSubstr(why)));
    };
    refused("", "is no Radiance picture");
    refused("\x89PNG\r\n\x1a\n", "is no Radiance picture");
    refused("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "does not end");
    refused("#?RADIANCE\n" + std::string(100000, 'x'), "does not end");
    refused(header("-Y 8 +X 16", "FORMAT=32-bit_rle_xyze\n"), "has the format '32-bit_rle_xyze'");
    refused(header("-Y 8 +X 16", "EXPOSURE=nan\n"), "has the exposure 'nan'");
    refused(header("-Y 8 +X 16", "EXPOSURE=0\n"), "has the exposure '0'");
    refused(header("-Y 8 +X 16", "EXPOSURE=1e-30\nEXPOSURE=1e-30\n"), "beyond what floats hold");
    refused(header("+Y 8 +X 16"), "no size of the kind");
    refused(header("-Y 8 +X 16 "), "no size of the kind");
    refused(header("-Y 8 +X 8"), "has 8 x 8 texels");
    refused(header("-Y 0 +X 0"), "has 0 x 0 texels");
    refused(header("-Y 999999999 +X 1999999998"), "no size of the kind");
    refused(header("-Y 10000 +X 20000"), "the limit is 16384");
    refused(header("-Y 8 +X 16"), "row 1 of 8 is cut short");
    const std::string whole = packed_picture();
    for (size_t length = header("-Y 8 +X 16").size(); length < whole.size(); ++length) {
        const auto read = decoded(whole.substr(0, length));
        ASSERT_FALSE(read) << length;
    }
    std::string past = whole;
    past[header("-Y 8 +X 16").size() + 4] = static_cast<char>(0xff);
    refused(past, "row 1 of 8 has run lengths beyond its end");
    refused(header("-Y 1 +X 2") + std::string("\1\1\1\2....", 8), "run lengths beyond its end");
}

}  // namespace
}  // namespace lodestone
