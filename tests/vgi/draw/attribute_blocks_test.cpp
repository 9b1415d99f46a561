#include "vgi/draw/attributes/attribute_blocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "shaders/shared/vgi_texels.h"

namespace lodestone::vgi {
namespace {

constexpr uint32_t everything = LODE_VGI_IN_BLOCKS | LODE_VGI_ALPHA_IN_BLOCKS | LODE_VGI_HAS_MATERIALS |
                                LODE_VGI_HAS_COLOURS | LODE_VGI_HAS_SURFACES | LODE_VGI_HAS_EMISSIONS | LODE_VGI_BAKED;

struct Texel {
    glm::vec3 normal{0, 0, 1};
    uint32_t material = 0;
    glm::uvec4 colour{255};
    glm::uvec3 surface{0}, emission{0};
};

AtlasAttributes all_attributes() {
    AtlasAttributes attributes;
    attributes.normals = attributes.colours = attributes.materials = true;
    attributes.surfaces = attributes.emissions = attributes.baked = true;
    return attributes;
}

// A page of 33 x 33 samples in words, and what its blocks hold of each.
class Blocks {
public:
    template <class At>
    Blocks(const At& at, uint32_t has, const AtlasAttributes& attributes, uint32_t cells = 32)
        : cells_(cells), layout_{has, attribute_words(attributes)} {
        for (uint32_t y = 0; y <= cells; ++y) {
            for (uint32_t x = 0; x <= cells; ++x) {
                const Texel t = at(x, y);
                const auto [u, v] = pack_octahedral(t.normal);
                page_.push_back(static_cast<uint8_t>(u) | uint32_t{static_cast<uint8_t>(v)} << 8 | t.material << 16);
                if (attributes.colours)
                    page_.push_back(t.colour.r | t.colour.g << 8 | t.colour.b << 16 | t.colour.a << 24);
                if (attributes.surfaces) page_.push_back(t.surface.x | t.surface.y << 8 | t.surface.z << 16);
                if (attributes.emissions) page_.push_back(t.emission.x | t.emission.y << 8 | t.emission.z << 16);
            }
        }
        const PageTree tree{cells};
        blocks_ = attribute_blocks(page_, tree, attributes, layout_);
    }
    size_t bytes() const { return blocks_.size() * sizeof(uint32_t); }
    size_t plain_bytes() const { return page_.size() * sizeof(uint32_t); }
    const uint32_t* plain(uint32_t x, uint32_t y) const {
        return &page_[(size_t{y} * (cells_ + 1) + x) * layout_.sample_words];
    }
    PlaceInBlocks place(uint32_t x, uint32_t y) const { return place_in_blocks(cells_, x, y, layout_); }
    const uint32_t* words(uint32_t x, uint32_t y) const { return &blocks_[place(x, y).word]; }
    BlockSample sample(uint32_t x, uint32_t y) const {
        const PlaceInBlocks at = place(x, y);
        const uint32_t axes = blocks_[layout_.first_axis(cells_) + at.block / 8];
        return block_sample(std::span(blocks_).subspan(at.word, layout_.block_words()),
                            axes >> (4 * (at.block % 8)) & 15, at.number, layout_.has);
    }
    uint32_t sample_words() const { return layout_.sample_words; }

private:
    uint32_t cells_;
    BlockLayout layout_;
    AttributePage page_;
    AttributeBlocks blocks_;
};

float degrees_between(const glm::vec3& a, const glm::vec3& b) {
    return std::acos(std::min(glm::dot(glm::normalize(a), glm::normalize(b)), 1.0f)) * 57.29578f;
}

TEST(AttributeBlocks, TakeHalfOfThePage) {
    const auto white = [](uint32_t, uint32_t) { return Texel(); };
    const Blocks all(white, everything & ~uint32_t{LODE_VGI_ALPHA_IN_BLOCKS}, all_attributes());
    EXPECT_EQ(all.plain_bytes(), 1089u * 16);
    EXPECT_LT(all.bytes(), all.plain_bytes() * 0.45);
    AtlasAttributes colours;
    colours.normals = colours.colours = colours.baked = true;
    const Blocks less(white, LODE_VGI_IN_BLOCKS | LODE_VGI_HAS_COLOURS | LODE_VGI_BAKED, colours);
    EXPECT_LT(less.bytes(), less.plain_bytes() * 0.42);
}

// Neighbouring pages and charts have the same samples there.
TEST(AttributeBlocks, KeepWhatIsOnTheSidesAsItIs) {
    std::mt19937 random(1);
    const auto anything = [&](uint32_t, uint32_t) {
        Texel t;
        t.material = random() % 60000;
        t.colour = {random() % 256, random() % 256, random() % 256, random() % 256};
        t.surface = t.emission = {random() % 256, random() % 256, random() % 256};
        return t;
    };
    for (const uint32_t cells : {32u, 16u, 2u}) {
        const Blocks blocks(anything, everything, all_attributes(), cells);
        for (uint32_t k = 0; k <= cells; ++k) {
            for (const auto& [x, y] : {std::pair(k, 0u), {k, cells}, {0u, k}, {cells, k}}) {
                ASSERT_EQ(blocks.place(x, y).number, PlaceInBlocks::in_plain);
                for (uint32_t w = 0; w < blocks.sample_words(); ++w)
                    EXPECT_EQ(blocks.words(x, y)[w], blocks.plain(x, y)[w]) << x << ' ' << y << ' ' << w;
            }
        }
    }
}

TEST(AttributeBlocks, HoldWhatVariesSmoothlyWithinAFewSteps) {
    const auto smooth = [](uint32_t x, uint32_t y) {
        Texel t;
        t.material = x / 11 + 3 * (y / 13);
        t.colour = {100 + x, 200 - 2 * y, 30 + x + y, 255 - 3 * x};
        t.surface = {40 + 2 * x, 250 - 3 * y, x + y};
        t.emission = {x, 2 * x, 3 * x};
        t.normal = glm::normalize(glm::vec3(0.02f * static_cast<float>(x), 0.03f * static_cast<float>(y), 1));
        return t;
    };
    const Blocks blocks(smooth, everything, all_attributes());
    for (uint32_t y = 1; y < 32; ++y) {
        for (uint32_t x = 1; x < 32; ++x) {
            const Texel t = smooth(x, y);
            const BlockSample s = blocks.sample(x, y);
            EXPECT_EQ(s.material, t.material) << x << ' ' << y;
            EXPECT_LT(degrees_between(s.normal, t.normal), 2.0f) << x << ' ' << y;
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(s.colour >> (8 * k) & 255, t.colour[k], 1) << x << ' ' << y << ' ' << k;
                EXPECT_NEAR(s.surface >> (8 * k) & 255, t.surface[k], 1) << x << ' ' << y << ' ' << k;
                EXPECT_NEAR(s.emission >> (8 * k) & 255, t.emission[k], 8) << x << ' ' << y << ' ' << k;
            }
            EXPECT_NEAR(s.colour >> 24, t.colour.a, 1) << x << ' ' << y;
        }
    }
}

TEST(AttributeBlocks, HoldWhatIsAllOneColourAsItIs) {
    for (uint32_t grey = 0; grey < 256; grey += 5) {
        const Blocks blocks(
            [&](uint32_t, uint32_t) {
                Texel t;
                t.colour = {grey, 255 - grey, grey / 2, 255};
                return t;
            },
            everything & ~uint32_t{LODE_VGI_ALPHA_IN_BLOCKS}, all_attributes());
        const BlockSample s = blocks.sample(9, 21);
        EXPECT_EQ(s.colour & 255, grey);
        EXPECT_EQ(s.colour >> 8 & 255, 255 - grey);
        EXPECT_EQ(s.colour >> 24, 255u);
    }
}

TEST(AttributeBlocks, HoldNumbersThatDifferByLessThanEightAsTheyAre) {
    for (uint32_t first = 0; first < 248; first += 31) {
        for (uint32_t range = 0; range < 8; ++range) {
            const auto at = [&](uint32_t x, uint32_t y) {
                Texel t;
                t.colour.r = first + (x + 3 * y) % (range + 1);
                return t;
            };
            const Blocks blocks(at, everything, all_attributes());
            for (uint32_t y = 1; y < 29; ++y) {
                for (uint32_t x = 1; x < 29; ++x)
                    ASSERT_EQ(blocks.sample(x, y).colour & 255, at(x, y).colour.r) << first << ' ' << range;
            }
        }
    }
}

// Around z alone a block whose normals look to either side of a fold would hold any direction between.
TEST(AttributeBlocks, HoldNormalsThatLookAnywhere) {
    std::mt19937 random(2);
    std::normal_distribution<float> any;
    float worst = 0;
    for (int k = 0; k < 200; ++k) {
        const glm::vec3 middle = k < 6 ? glm::vec3(k % 3 == 0, k % 3 == 1, k % 3 == 2) * (k < 3 ? 1.0f : -1.0f)
                                       : glm::normalize(glm::vec3(any(random), any(random), any(random)));
        const glm::vec3 across = glm::normalize(glm::cross(middle, glm::vec3(0.3f, 0.5f, 0.7f))),
                        down = glm::cross(middle, across);
        // A block spans about 12 degrees.
        const auto bent = [&](uint32_t x, uint32_t y) {
            Texel t;
            t.normal = glm::normalize(middle + 0.05f * (static_cast<float>(x) - 16) * across +
                                      0.05f * (static_cast<float>(y) - 16) * down);
            return t;
        };
        AtlasAttributes normals;
        normals.normals = normals.baked = true;
        const Blocks blocks(bent, LODE_VGI_IN_BLOCKS | LODE_VGI_BAKED, normals);
        for (uint32_t y = 1; y < 32; ++y) {
            for (uint32_t x = 1; x < 32; ++x)
                worst = std::max(worst, degrees_between(blocks.sample(x, y).normal, bent(x, y).normal));
        }
    }
    EXPECT_LT(worst, 4.0f);
}

TEST(AttributeBlocks, HaveUpToFourMaterials) {
    const auto four = [](uint32_t x, uint32_t y) {
        Texel t;
        t.material = 1000 * (1 + (x + 2 * y) % 4);
        return t;
    };
    const Blocks exact(four, everything, all_attributes());
    for (uint32_t y = 1; y < 32; ++y) {
        for (uint32_t x = 1; x < 32; ++x) EXPECT_EQ(exact.sample(x, y).material, four(x, y).material);
    }
    // Of a fifth there is one sample; it takes that which has most.
    const auto five = [&](uint32_t x, uint32_t y) {
        Texel t = four(x, y);
        if (x == 6 && y == 6) t.material = 9;
        if (x == 5 && y == 6) t.material = 4000;
        return t;
    };
    const Blocks most(five, everything, all_attributes());
    EXPECT_EQ(most.sample(6, 6).material, 4000u);
    EXPECT_EQ(most.sample(5, 5).material, five(5, 5).material);
}

}  // namespace
}  // namespace lodestone::vgi
