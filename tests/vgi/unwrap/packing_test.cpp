#include "vgi/unwrap/packing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace lodestone::vgi {
namespace {

std::vector<WantedRectangle> random_rectangles(size_t count, uint64_t seed) {
    Random random(seed);
    std::vector<WantedRectangle> wanted;
    for (size_t i = 0; i < count; ++i) wanted.push_back({0.2 + random.unit(), 0.2 + random.unit()});
    return wanted;
}

double area_of(const std::vector<PackedRectangle>& packed) {
    double area = 0;
    for (const PackedRectangle& r : packed) area += r.width * r.height;
    return area;
}

TEST(Packing, RectanglesKeepTheirDistance) {
    for (const double gutter : {0.0, 1.0 / 1024, 1.0 / 64}) {
        for (const uint32_t squares : {1u, 3u}) {
            const auto packed = pack(random_rectangles(100, 7), squares, gutter);
            ASSERT_TRUE(packed);
            for (size_t i = 0; i < packed->size(); ++i) {
                const PackedRectangle& a = (*packed)[i];
                EXPECT_GE(a.x, gutter / 2 - 1e-12);
                EXPECT_GE(a.y, gutter / 2 - 1e-12);
                EXPECT_LE(a.x + a.width, 1 - gutter / 2 + 1e-9);
                EXPECT_LE(a.y + a.height, 1 - gutter / 2 + 1e-9);
                for (size_t j = i + 1; j < packed->size(); ++j) {
                    const PackedRectangle& b = (*packed)[j];
                    if (a.square != b.square) continue;
                    const double dx = std::max(b.x - a.x - a.width, a.x - b.x - b.width),
                                 dy = std::max(b.y - a.y - a.height, a.y - b.y - b.height);
                    EXPECT_GE(std::max(dx, dy), gutter - 1e-9) << i << " " << j;
                }
            }
        }
    }
}

TEST(Packing, FillsTheSquareButForGutters) {
    const auto packed = pack(random_rectangles(200, 3), 1, 1.0 / 1024);
    ASSERT_TRUE(packed);
    EXPECT_GT(area_of(*packed), 0.95);
}

TEST(Packing, KeepsRatiosOfAreasAndMostOfShapes) {
    const auto wanted = random_rectangles(150, 5);
    const auto packed = pack(wanted, 1, 0);
    ASSERT_TRUE(packed);
    const double scale = area_of(*packed);
    double whole = 0;
    for (const WantedRectangle& r : wanted) whole += r.width * r.height;
    double off = 0;
    for (size_t i = 0; i < wanted.size(); ++i) {
        const PackedRectangle& p = (*packed)[i];
        off += std::abs(p.width * p.height / scale - wanted[i].width * wanted[i].height / whole);
        const double shape = p.turned ? p.height / p.width : p.width / p.height;
        EXPECT_LT(std::abs(std::log(shape * wanted[i].height / wanted[i].width)), std::log(1.7));
    }
    EXPECT_LT(off, 0.05) << "of cells that would change a shape too much a part stays empty";
}

TEST(Packing, OneNeedleIsNotMadeASquare) {
    const std::vector<WantedRectangle> wanted = {{8, 1}};
    const auto packed = pack(wanted, 1, 0.01);
    ASSERT_TRUE(packed);
    const PackedRectangle& p = packed->front();
    EXPECT_GT(std::max(p.width, p.height) / std::min(p.width, p.height), 4);
}

TEST(Packing, GuttersThatLeaveNoRoomAreTold) { EXPECT_FALSE(pack(random_rectangles(100, 1), 1, 0.2)); }

}  // namespace
}  // namespace lodestone::vgi
