#include "vgi/draw/attributes/mip_tail.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "mesh/generate.h"
#include "mesh/repair.h"
#include "shaders/shared/vgi_texels.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

struct Small {
    Atlas atlas;
    std::vector<std::shared_ptr<const AttributePage>> coarsest;
    AttributePage levels;
    uint32_t n, words;
};

Small mip_tail_of(Atlas atlas, uint32_t more_words = 0) {
    Small s;
    s.words = attribute_words(atlas.attributes) + more_words;
    const PageTree tree = tree_of(atlas, Layer::attributes);
    s.n = tree.cells_per_page();
    for (uint32_t chart = 0; chart < atlas.charts(); ++chart) {
        const Page page = read_pages(atlas, Layer::attributes, chart)[0];
        s.coarsest.push_back(
            std::make_shared<const AttributePage>(packed_attributes(page, tree, atlas.attributes, s.words)));
    }
    s.levels = mip_tail(atlas, s.coarsest, s.words);
    s.atlas = std::move(atlas);
    return s;
}

const uint32_t* sample(const Small& s, uint32_t chart, uint32_t level, uint32_t x, uint32_t y) {
    const uint32_t row = (s.n >> level) + 1;
    return s.levels.data() +
           (size_t{chart} * mip_tail_samples(s.n) + LODE_VGI_SMALL_FIRST(s.n, level) + y * row + x) * s.words;
}
glm::vec3 normal(uint32_t word) {
    return unpack_octahedral({static_cast<int8_t>(word & 255), static_cast<int8_t>(word >> 8 & 255)});
}

TEST(SmallLevels, LieOneAfterTheOther) {
    for (const uint32_t n : {2u, 8u, 32u}) {
        uint32_t samples = 0;
        for (uint32_t level = 1; n >> level > 0; ++level) {
            EXPECT_EQ(LODE_VGI_SMALL_FIRST(n, level), samples) << n << " " << level;
            samples += ((n >> level) + 1) * ((n >> level) + 1);
        }
        EXPECT_EQ(mip_tail_samples(n), samples) << n;
    }
}

TEST(SmallLevels, AgreeWhereChartsAreGluedAndAreMeansOfWhatIsAround) {
    TriMesh mesh = generate(Shape::rock, 5000, 3);
    ASSERT_TRUE(repair(mesh));
    const Small s = mip_tail_of(small_atlas(mesh, 32), 1);  // a word that this atlas does not use
    ASSERT_EQ(s.n, 32u);
    size_t glued = 0, across = 0;
    for (uint32_t chart = 0; chart < s.atlas.charts(); ++chart) {
        for (uint32_t side = 0; side < 4; ++side) {
            const GluedSide& other = s.atlas.sides[4 * chart + side];
            ASSERT_NE(other.chart, ~0u);
            for (uint32_t level = 1; level <= 5; ++level) {
                const uint32_t cells = s.n >> level;
                for (uint32_t step = 0; step <= cells; ++step) {
                    const auto [x, y] = on_side(side, step, cells);
                    const auto [u, v] = on_side(other.side, cells - step, cells);
                    EXPECT_EQ(*sample(s, chart, level, x, y) & 0xffff, *sample(s, other.chart, level, u, v) & 0xffff);
                    ++glued;
                }
            }
            // The middle of a side, from both charts.
            const auto [x, y] = on_side(side, 1u, 2u);
            glm::vec3 sum(0);
            for (const auto& [c, r] : {std::pair{chart, side}, std::pair{other.chart, other.side}}) {
                for (int32_t along = -1; along <= 1; ++along) {
                    for (int32_t in = 0; in <= 1; ++in) {
                        const auto step = static_cast<uint32_t>(2 + along);
                        const auto [p, q] = on_side(r, step, 4u);
                        const uint32_t px = in == 0 || r % 2 == 0 ? p
                                            : r == 1              ? p - 1
                                                                  : p + 1,
                                       py = in == 0 || r % 2 == 1 ? q
                                            : r == 0              ? q + 1
                                                                  : q - 1;
                        sum += (along == 0 ? 2.0f : 1.0f) * normal(*sample(s, c, 3, px, py));
                    }
                }
            }
            const float cosine = glm::dot(glm::normalize(sum), normal(*sample(s, chart, 4, x, y)));
            across += cosine > 0.98f;
        }
    }
    EXPECT_GT(glued, 1000u);
    // Of means that are not rounded to length 1 first, so not all are the same.
    EXPECT_GT(across, s.atlas.charts() * 4 * 9 / 10);
}

TEST(SmallLevels, SmoothNoiseAndKeepCreases) {
    Atlas atlas = small_atlas(generate(Shape::sphere, 3000, 1), 32);
    // Noise as fine as samples are leaves next to nothing.
    Small s = mip_tail_of(atlas);
    double before = 0, after = 0;
    for (uint32_t chart = 0; chart < atlas.charts(); ++chart) {
        for (uint32_t y = 1; y < 32; ++y) {
            for (uint32_t x = 1; x < 32; ++x) {
                auto& n = atlas.normals[atlas.attribute_texel(chart, x, y)];
                const glm::vec3 plain = unpack_octahedral(n);
                const glm::vec3 bumpy = glm::normalize(plain + 0.1f * glm::vec3((x + y) % 2 != 0 ? 1 : -1));
                n = pack_octahedral(bumpy);
                if (x % 8 == 0 && y % 8 == 0) before += glm::distance(plain, unpack_octahedral(n));
            }
        }
    }
    const Small noisy = mip_tail_of(atlas);
    for (uint32_t chart = 0; chart < atlas.charts(); ++chart) {
        for (uint32_t y = 1; y < 4; ++y) {
            for (uint32_t x = 1; x < 4; ++x)
                after += glm::distance(normal(*sample(noisy, chart, 3, x, y)), normal(*sample(s, chart, 3, x, y)));
        }
    }
    EXPECT_LT(after, before / 10);
    // A chart turned against the others has a crease around it: nothing of it leaks out, and nothing in.
    Atlas turned = small_atlas(generate(Shape::sphere, 3000, 1), 32);
    for (uint32_t y = 0; y <= 32; ++y) {
        for (uint32_t x = 0; x <= 32; ++x) turned.normals[turned.attribute_texel(0, x, y)] = pack_octahedral({0, 0, 1});
    }
    const Small creased = mip_tail_of(turned);
    for (uint32_t level = 1; level <= 5; ++level) {
        for (uint32_t y = 0; y <= 32u >> level; ++y) {
            for (uint32_t x = 0; x <= 32u >> level; ++x)
                EXPECT_GT(normal(*sample(creased, 0, level, x, y)).z, 0.999f) << level << " " << x << " " << y;
        }
    }
}

}  // namespace
}  // namespace lodestone::vgi
