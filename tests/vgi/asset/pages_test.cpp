#include "vgi/asset/codec/page_family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "base/random.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/chart_pages.h"
#include "vgi/asset/codec/unsampled_pages.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/page_means.h"

namespace lodestone::vgi {
namespace {

TEST(Pages, CodeAnyNumbers) {
    // Noise, extremes and constants come back as they were.
    const PageTree tree{64};
    using Kind = Channel::Kind;
    const std::vector<Channel> channels{{0, true, false},
                                        {0, true, false, Kind::smooth},
                                        {0, true, false, Kind::name},
                                        {1, false, false, Kind::error},
                                        {2, false, false, Kind::radius},
                                        {3, false, true},
                                        {4, true, false}};
    constexpr size_t kinds = 7;
    const size_t plane = 33 * 33;
    std::vector<Page> pages(tree.pages());
    uint32_t state = 1;
    const auto next = [&] { return state = state * 1664525u + 1013904223u; };
    for (uint32_t p = 0; p < tree.pages(); ++p) {
        Page& page = pages[p];
        page.values.resize(kinds * plane);
        for (size_t i = 0; i < plane; ++i) {
            for (size_t c = 0; c < 3; ++c) page.values[c * plane + i] = static_cast<uint16_t>(next() >> 16);
            for (size_t c = 3; c < 5; ++c) page.values[c * plane + i] = static_cast<uint16_t>(next() >> 24);
            page.values[5 * plane + i] = static_cast<uint16_t>(static_cast<int8_t>(next() >> 24));
            page.values[6 * plane + i] = p < 2 ? 7 : 65535;
        }
    }
    // A page has its parent's samples.
    for (uint32_t p = 1; p < tree.pages(); ++p) {
        uint32_t level = 0, x = 0, y = 0;
        tree.place(p, &level, &x, &y);
        for (size_t c = 0; c < kinds; ++c) {
            for (size_t v = 0; v < 33; v += 2) {
                for (size_t u = 0; u < 33; u += 2)
                    pages[p].values[(c * 33 + v) * 33 + u] =
                        pages[0].values[(c * 33 + y * 16 + v / 2) * 33 + x * 16 + u / 2];
            }
        }
    }
    ASSERT_EQ(tree.families(), 2u);
    for (uint32_t f = 0; f < tree.families(); ++f) {
        auto bytes = encode_family(tree, channels, f, pages);
        const auto back = PageFamily::unpack(tree, channels, f, bytes);
        ASSERT_TRUE(back);
        for (uint32_t k = 0; k < PageTree::members(f); ++k) {
            const uint32_t p = tree.member(f, k);
            EXPECT_EQ(tree.family(p), f);
            EXPECT_EQ(back->page(p, p == 0 ? nullptr : &pages[0]).values, pages[p].values) << p;
        }
        // Anything cut off or added is refused, never read past.
        for (size_t size = 0; size < bytes.size(); size += 97)
            EXPECT_FALSE(PageFamily::unpack(tree, channels, f, std::span(bytes).first(size)));
        bytes.push_back(std::byte{0});
        EXPECT_FALSE(PageFamily::unpack(tree, channels, f, bytes));
    }
}

// Of pages that are sampled at every fourth place each way: all kinds of numbers come back, between them what lies
// there, and they take no more bytes than a page of as many samples.
TEST(Pages, ComeBackWhereFewOfThePlacesAreSampled) {
    const PageTree sparse{16, 2}, dense{4};
    AtlasAttributes all;
    all.uvs = all.colours = all.materials = true;
    for (const Layer layer : {Layer::geometry, Layer::attributes}) {
        const std::vector<Channel> channels = channels_of(all, layer);
        Page few;
        Random random(9);
        for (const Channel& channel : channels) {
            for (int i = 0; i < 25; ++i) {
                const auto value = static_cast<int32_t>(random.unit() * (channel.wide ? 65535 : 127));
                few.values.push_back(static_cast<uint16_t>(channel.is_signed ? value - 63 : value));
            }
        }
        std::vector<Page> pages{spread_samples(sparse, channels, few, 4)};
        ASSERT_EQ(pages[0].values.size(), channels.size() * 17 * 17);
        const std::vector<Page> before = pages;
        const auto bytes = encode_family(sparse, channels, 0, pages);
        EXPECT_EQ(pages[0].values, before[0].values);
        const auto back = PageFamily::unpack(sparse, channels, 0, bytes);
        ASSERT_TRUE(back);
        EXPECT_EQ(back->page(0, nullptr).values, before[0].values);
        std::vector<Page> alone{few};
        EXPECT_EQ(bytes, encode_family(dense, channels, 0, alone));
        // Half way between two samples of a row.
        for (size_t c = 0; c < channels.size(); ++c) {
            const uint16_t* const at = before[0].values.data() + c * 17 * 17;
            const uint16_t between = at[2], a = at[0], b = at[4];
            switch (channels[c].kind) {
                case Channel::Kind::error:
                    EXPECT_EQ(between, 0);
                    break;
                case Channel::Kind::radius:
                    EXPECT_EQ(between, ErrorCodes::absent);
                    break;
                case Channel::Kind::name:
                    EXPECT_TRUE(between == a || between == b);
                    break;
                case Channel::Kind::direction:
                    break;  // both numbers together
                default:
                    EXPECT_EQ(between, (a + b + 1) / 2);
            }
        }
    }
}

TEST(Pages, ErrorsThatPositionsTellTakeNextToNothing) {
    // A bumpy surface whose finest samples err as far as they are off the triangles without them, saturated; and errors
    // about as large that have nothing to do with it.
    using Kind = Channel::Kind;
    const PageTree tree{64};
    const std::vector<Channel> channels{{0, true, false, Kind::smooth},
                                        {0, true, false, Kind::smooth},
                                        {0, true, false, Kind::smooth},
                                        {1, false, false, Kind::error}};
    const Bintree bintree{64};
    std::vector<uint16_t> heights(65 * 65);
    for (size_t i = 0; i < heights.size(); ++i) heights[i] = static_cast<uint16_t>(1000 + mix64(i) % 200);
    const auto point = [&](GridPoint p) {
        return glm::dvec3(100 * p.x, 100 * p.y, heights[static_cast<size_t>(p.y * 65 + p.x)]);
    };
    const ErrorCodes codes(65535 * std::sqrt(3.0));
    const auto off_triangles = [&](GridPoint p) {
        const auto ends = bintree.hypotenuse(p);
        double off = 0;
        bintree.for_parents(p, [&](GridPoint q) {
            const auto& [a, b] = ends;
            const glm::dvec3 normal = glm::normalize(glm::cross(point(b) - point(a), point(q) - point(a)));
            off = std::max(off, std::abs(glm::dot(normal, point(p) - point(a))));
        });
        return uint32_t{round_up(codes.of_error(off), 0)};
    };
    const auto error = [&](GridPoint p) {
        if (bintree.level(p) > 0) return 200u;
        uint32_t code = off_triangles(p);
        if (bintree.is_centre(p))
            bintree.for_children(p, [&](GridPoint q) { code = std::max(code, off_triangles(q) + 4); });
        return code;
    };
    const auto size_with = [&](bool told) {
        std::vector<Page> pages = pages_of(tree, channels, [&](uint32_t c, uint32_t x, uint32_t y) -> uint32_t {
            const GridPoint p{static_cast<int32_t>(x), static_cast<int32_t>(y)};
            if (c < 3) return static_cast<uint32_t>(point(p)[static_cast<int>(c)]);
            if (told || bintree.level(p) > 0) return error(p);
            return round_up(static_cast<uint32_t>(120 + mix64(x + 65 * y) % 60), 0);
        });
        size_t size = encode_family(tree, channels, 1, pages).size();
        for (Page& page : pages) std::fill(page.values.begin() + 3 * 33 * 33, page.values.end(), uint16_t{0});
        size -= encode_family(tree, channels, 1, pages).size();
        return size;
    };
    EXPECT_LT(6 * size_with(true), size_with(false)) << size_with(true);
}

TEST(Pages, EveryPageIsInOneFamily) {
    const PageTree tree{256};
    std::vector<uint32_t> met(tree.pages(), 0);
    for (uint32_t f = 0; f < tree.families(); ++f) {
        for (uint32_t k = 0; k < PageTree::members(f); ++k) {
            const uint32_t p = tree.member(f, k);
            ++met.at(p);
            EXPECT_EQ(tree.family(p), f);
            EXPECT_EQ(p == 0 ? 0 : tree.parent(p) + 1, f);
        }
    }
    EXPECT_THAT(met, testing::Each(1u));
}

constexpr Channel normal{0, false, true, Channel::Kind::direction, true},
    grey{1, false, false, Channel::Kind::amount, true}, name{2, true, false, Channel::Kind::name};

TEST(PageMeans, GiveTheSamplesBackAndAgreeOnBorders) {
    // Whatever they are: extremes, and directions across the folds of the octahedral map.
    const PageTree tree{128};
    const std::vector<Channel> channels{normal, normal, grey, name};
    for (const bool extremes : {false, true}) {
        const auto value = [&](uint32_t c, uint32_t x, uint32_t y) -> int32_t {
            const auto noise = static_cast<uint32_t>(mix64(c * 1000003ull + y * 1009ull + x));
            if (c == 3) return static_cast<int32_t>(noise & 0xffff);
            if (c == 2) return extremes ? (noise & 1) * 255 : static_cast<int32_t>(100 + noise % 50);
            return extremes ? ((noise & 1) != 0 ? 127 : -127) : static_cast<int32_t>(noise % 100) - 50;
        };
        std::vector<Page> pages = pages_of(tree, channels, value);
        std::vector<Page> back(pages.size());
        for (uint32_t f = 0; f < tree.families(); ++f) {
            const auto bytes = encode_family(tree, channels, f, pages);
            const auto family = PageFamily::unpack(tree, channels, f, bytes);
            ASSERT_TRUE(family);
            for (uint32_t k = 0; k < PageTree::members(f); ++k) {
                const uint32_t p = tree.member(f, k);
                back[p] = family->page(p, p == 0 ? nullptr : &back[tree.parent(p)]);
                ASSERT_EQ(back[p].values, pages[p].values) << p;
            }
        }
        expect_neighbours_agree(tree, pages);
    }
}

TEST(PageMeans, AreNearerToWhatIsUnderTheNoise) {
    const PageTree tree{128};
    const std::vector<Channel> channels{grey};
    const auto smooth = [](double x, double y) { return 128 + 60 * std::sin(x / 40) * std::cos(y / 30); };
    const auto value = [&](uint32_t, uint32_t x, uint32_t y) {
        const double noise = static_cast<double>(mix64(y * 1009ull + x) % 1000) / 999 - 0.5;
        return std::lround(smooth(x, y) + 40 * noise);
    };
    const std::vector<Page> pages = pages_of(tree, channels, value);
    double of_means = 0, of_samples = 0;
    for (uint32_t i = 0; i < 33 * 33; ++i) {
        const uint32_t x = i % 33 * 4, y = i / 33 * 4;  // two levels
        const double under = smooth(x, y);
        of_means += std::pow(pages[0].values[i] - under, 2);
        of_samples += std::pow(static_cast<double>(value(0, x, y)) - under, 2);
    }
    EXPECT_LT(std::sqrt(of_means / of_samples), 0.4);
}

}  // namespace
}  // namespace lodestone::vgi
