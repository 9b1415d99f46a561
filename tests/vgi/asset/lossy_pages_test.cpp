// Pages whose channels may lose something: what is decoded is near, the same wherever it is one place, and smaller.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/random.h"
#include "vgi/asset/chart_pages.h"
#include "vgi/asset/codec/page_family.h"
#include "vgi/asset/page_means.h"

namespace lodestone::vgi {
namespace {

std::vector<Channel> channels_with(uint8_t quality, uint8_t dense_quality = 0) {
    AtlasAttributes has{{true, false, true, true}, true, true, true, true};
    has.texture_quality = quality;
    has.dense_quality = dense_quality;
    return channels_of(has, Layer::attributes, dense_quality > 0);
}

// A picture of waves, edges and grain over the plane; flat in channel 5, of which alpha is one.
int32_t painted(uint32_t channel, int32_t x, int32_t y) {
    if (channel == 5) return 255;
    if (channel == 12) return (x / 9 + y / 7) % 3;
    const double wave = std::sin(0.11 * x + channel) + std::cos(0.07 * y - 0.03 * x * channel);
    const double edge = (x * 3 + y * 5 + 40 * static_cast<int32_t>(channel)) % 97 < 48 ? 30 : -30;
    const auto grain =
        static_cast<double>(mix64(static_cast<uint64_t>((x + 4096) * 8192 + y + 4096) * 16 + channel) % 8);
    const double value = 25 * wave + edge + grain;
    return static_cast<int32_t>(channel < 2 ? std::clamp(value, -127.0, 127.0) : std::clamp(128 + value, 0.0, 255.0));
}

struct Coded {
    std::vector<Page> pages;  // decoded
    size_t bytes = 0;
};
// Encodes and decodes all families; what the encoder leaves must be what is decoded.
Coded coded(const PageTree& tree, std::span<const Channel> channels, std::vector<Page> pages) {
    Coded done{std::vector<Page>(tree.pages()), 0};
    for (uint32_t f = 0; f < tree.families(); ++f) {
        const auto bytes = encode_family(tree, channels, f, pages);
        done.bytes += bytes.size();
        const auto family = PageFamily::unpack(tree, channels, f, bytes);
        EXPECT_TRUE(family) << f;
        if (!family) return done;
        for (uint32_t k = 0; k < PageTree::members(f); ++k) {
            const uint32_t p = tree.member(f, k);
            done.pages[p] = family->page(p, p == 0 ? nullptr : &done.pages[tree.parent(p)]);
            EXPECT_EQ(done.pages[p].values, pages[p].values) << p;
        }
    }
    return done;
}

// What a channel may be off by more than colours, dB.
double coarser(std::span<const Channel> channels, size_t channel) {
    // Numbers are rounded to whole ones after that, 16 sixteenths.
    const auto off = [&](size_t c) { return std::pow(channels[c].step, 2) + 16 * 16; };
    return 10 * std::log10(off(channel) / off(2));
}

double psnr(const std::vector<Page>& a, const std::vector<Page>& b, size_t samples, size_t channel) {
    double squared = 0;
    size_t count = 0;
    for (size_t p = 0; p < a.size(); ++p) {
        for (size_t i = channel * samples; i < (channel + 1) * samples; ++i, ++count) {
            const double off = static_cast<int16_t>(a[p].values[i]) - static_cast<int16_t>(b[p].values[i]);
            squared += off * off;
        }
    }
    return 10 * std::log10(255.0 * 255.0 / (squared / static_cast<double>(count) + 1e-9));
}

TEST(LossyPages, AreNearerTheHigherTheQualityAndSmallerTheLower) {
    const PageTree tree{128};
    const auto at = [](uint32_t c, int32_t x, int32_t y) { return painted(c, x, y); };
    const auto lossless = channels_with(0);
    size_t bytes_before = coded(tree, lossless, pages_of(tree, lossless, at)).bytes;
    // Twice the step takes 6 dB at the most.
    for (const auto& [quality, least] : {std::pair<uint8_t, double>(95, 50), {75, 41}, {55, 30}, {1, 10}}) {
        const auto channels = channels_with(quality);
        const std::vector<Page> pages = pages_of(tree, channels, at);
        const Coded done = coded(tree, channels, pages);
        EXPECT_LT(done.bytes, bytes_before) << int{quality};
        bytes_before = done.bytes;
        for (size_t c = 0; c < channels.size(); ++c)
            EXPECT_GT(psnr(done.pages, pages, 33 * 33, c) + coarser(channels, c), least) << int{quality} << ", " << c;
        // What is flat stays, and materials are what they were.
        EXPECT_GT(psnr(done.pages, pages, 33 * 33, 5), 100) << int{quality};
        EXPECT_GT(psnr(done.pages, pages, 33 * 33, 12), 100) << int{quality};
    }
}

// The finest level may be off by more than others, which are what they would be without it.
TEST(LossyPages, OfDenseLevelsHaveAQualityOfTheirOwn) {
    const PageTree tree{128};
    const auto evenly = channels_with(80), dense = channels_with(80, 60);
    const auto at = [](uint32_t c, int32_t x, int32_t y) { return painted(c, x, y); };
    const std::vector<Page> pages = pages_of(tree, evenly, at);
    const Coded even = coded(tree, evenly, pages), apart = coded(tree, dense, pages);
    EXPECT_LT(5 * apart.bytes, 4 * even.bytes);
    const auto finest = [&](const std::vector<Page>& all) {
        return std::vector<Page>(all.begin() + tree.page(0, 0, 0), all.end());
    };
    for (uint32_t p = 0; p < tree.page(0, 0, 0); ++p) EXPECT_EQ(even.pages[p].values, apart.pages[p].values) << p;
    for (size_t c = 0; c < 5; ++c) {
        const double nearer = psnr(finest(even.pages), finest(pages), 33 * 33, c),
                     farther = psnr(finest(apart.pages), finest(pages), 33 * 33, c);
        EXPECT_LT(farther, nearer - 4) << c;
        EXPECT_GT(farther, nearer - 13) << c;  // four times the step
    }
}

// Where a texture is finer than the picture, coarser levels are what is seen.
TEST(LossyPages, OfCoarserLevelsAreNearer) {
    const PageTree tree{256};
    const auto level = [&](const std::vector<Page>& all, uint32_t l) {
        return std::vector<Page>(all.begin() + tree.page(l, 0, 0),
                                 l > 0 ? all.begin() + tree.page(l - 1, 0, 0) : all.end());
    };
    // Of normals, whose steps are finer; of colours, surfaces and emissions.
    for (const auto& [quality, of] : {std::pair<uint8_t, std::vector<size_t>>{50, {0}}, {60, {2, 6, 9}}}) {
        const auto channels = channels_with(quality);
        const auto pages = pages_of(tree, channels, [](uint32_t c, int32_t x, int32_t y) { return painted(c, x, y); });
        const auto decoded = coded(tree, channels, pages).pages;
        for (const size_t c : of) {
            for (uint32_t l = 1; l < 3; ++l) {
                const double finer = psnr(level(decoded, l - 1), level(pages, l - 1), 33 * 33, c),
                             coarser = psnr(level(decoded, l), level(pages, l), 33 * 33, c);
                EXPECT_GT(coarser, finer + 1.5) << c << ", level " << l;
            }
        }
    }
}

TEST(LossyPages, StepsOfCoarserLevelsAreHalvesDownToFour) {
    const auto expect_steps = [](const Channel& channel, const std::vector<uint32_t>& steps) {
        for (uint32_t level = 0; level < steps.size(); ++level)
            EXPECT_EQ(channel.step_of(level), steps[level]) << level;
    };
    const auto usual = channels_with(60), fine = channels_with(95), dense = channels_with(60, 50);
    expect_steps(usual[2], {256, 128, 64, 64, 64});
    expect_steps(usual[6], {768, 384, 192, 96, 96});
    expect_steps(dense[6], {1536, 384, 192, 96, 96});
    expect_steps(fine[2], {23, 23, 23, 23});
    expect_steps(fine[6], {69, 64, 64, 64});
    expect_steps(channels_with(0)[2], {0, 0, 0, 0});
}

TEST(LossyPages, AreOfAnySize) {
    for (const uint32_t cells : {2u, 4u, 8u, 16u, 32u, 64u}) {
        const PageTree tree{cells};
        const auto channels = channels_with(80);
        const std::vector<Page> pages =
            pages_of(tree, channels, [](uint32_t c, int32_t x, int32_t y) { return painted(c, x, y); });
        const Coded done = coded(tree, channels, pages);
        const size_t samples = size_t{tree.samples_per_side()} * tree.samples_per_side();
        for (size_t c = 0; c < channels.size(); ++c)
            EXPECT_GT(psnr(done.pages, pages, samples, c) + coarser(channels, c), 41) << cells << ", " << c;
    }
}

// Of a page, what lies on a side of the chart, in the order of on_side.
std::vector<uint16_t> side_of(const PageTree& tree, const std::vector<Page>& pages, size_t channel, uint32_t level,
                              uint32_t side) {
    const uint32_t n = tree.cells_per_page(), per_side = tree.pages_per_side(level), length = n * per_side;
    std::vector<uint16_t> values;
    for (uint32_t step = 0; step <= length; ++step) {
        const auto [x, y] = on_side(side, step, length);
        const uint32_t px = std::min(x / n, per_side - 1), py = std::min(y / n, per_side - 1);
        const Page& page = pages[tree.page(level, px, py)];
        values.push_back(page.values[(channel * (n + 1) + (y - py * n)) * (n + 1) + (x - px * n)]);
    }
    return values;
}

// Two charts with nothing in common but a line, which lies on any side of either, are decoded to one line, at every
// level.
TEST(LossyPages, AreEqualWhereChartsMeet) {
    const PageTree tree{128};
    const auto channels = channels_with(50);
    constexpr int32_t n = 128;
    // The place along the line is s; what is beside it is far away in the picture, and another for either chart.
    const auto chart = [&](uint32_t side, bool reversed, int32_t offset) {
        return coded(tree, channels,
                     pages_of(tree, channels,
                              [=](uint32_t c, int32_t x, int32_t y) {
                                  const int32_t along[] = {x, y, n - x, n - y}, off[] = {y, n - x, n - y, x};
                                  const int32_t s = reversed ? n - along[side] : along[side], away = off[side];
                                  return painted(c, s, away == 0 ? 0 : away * 3 + offset);
                              }))
            .pages;
    };
    const auto first = chart(0, false, 500);
    size_t met = 0;
    for (uint32_t side = 0; side < 4; ++side) {
        const auto other = chart(side, true, 1000 + 300 * static_cast<int32_t>(side));
        for (uint32_t level = 0; level <= tree.base_level(); ++level) {
            for (size_t c = 0; c < channels.size(); ++c) {
                const auto here = side_of(tree, first, c, level, 0);
                auto there = side_of(tree, other, c, level, side);
                std::ranges::reverse(there);
                ASSERT_EQ(here.size(), there.size());
                // The corners have other neighbours across the line, and are their own.
                EXPECT_EQ(here, there) << "side " << side << ", level " << level << ", channel " << c;
                ++met;
            }
        }
    }
    EXPECT_EQ(met, 4u * 3 * channels.size());
}

TEST(LossyPages, AreEqualWherePagesOfAChartMeet) {
    const PageTree tree{128};
    const auto channels = channels_with(40);
    const auto pages =
        coded(tree, channels,
              pages_of(tree, channels, [](uint32_t c, int32_t x, int32_t y) { return painted(c, x, y); }))
            .pages;
    expect_neighbours_agree(tree, pages);
}

TEST(LossyPages, AreRefusedWhereBytesAreMissingOrTooMany) {
    const PageTree tree{64};
    const auto channels = channels_with(70);
    auto pages = pages_of(tree, channels, [](uint32_t c, int32_t x, int32_t y) { return painted(c, x, y); });
    for (uint32_t f = 0; f < tree.families(); ++f) {
        auto bytes = encode_family(tree, channels, f, pages);
        for (size_t size = 0; size < bytes.size(); size += 13)
            EXPECT_FALSE(PageFamily::unpack(tree, channels, f, std::span(bytes).first(size))) << size;
        bytes.push_back(std::byte{0});
        EXPECT_FALSE(PageFamily::unpack(tree, channels, f, bytes));
    }
}

}  // namespace
}  // namespace lodestone::vgi
