// What counts as the rim of an open surface where rims touch and where holes have closed at a coarse level.
#include <gtest/gtest.h>

#include <initializer_list>
#include <utility>

#include "tiles/check/rim.h"

namespace lodestone::tiles {
namespace {

using Ring = std::vector<uint32_t>;

// Edges from each place of the rings to the next, and from the last to the first.
std::vector<BorderEdge> edges_of(const std::vector<Ring>& rings) {
    EdgeSum sum;
    for (const Ring& ring : rings) {
        for (size_t i = 0; i < ring.size(); ++i) {
            const uint64_t a = ring[i], b = ring[(i + 1) % ring.size()];
            sum.add(std::vector<BorderEdge>{{std::min(a, b) << 32 | std::max(a, b), a < b ? 1 : -1}});
        }
    }
    return sum.left();
}
// shown: corners of tiles that stand at places of the rim.
uint64_t gaps(const std::vector<Ring>& finest, const std::vector<Ring>& left, const Ring& shown) {
    return Rim(edges_of(finest)).gaps(edges_of(left), shown);
}

TEST(Rims, EachSampleMayBeLeftOut) {
    const Ring fine = {0, 1, 2, 3, 4, 5, 6, 7};
    EXPECT_EQ(gaps({fine}, {fine}, fine), 0u);
    EXPECT_EQ(gaps({fine}, {{0, 2, 4, 6}}, {0, 2, 4, 6}), 0u);
    EXPECT_EQ(gaps({fine}, {{0, 2, 3, 4, 6}}, {0, 2, 3, 4, 6}), 0u);
    EXPECT_EQ(gaps({fine}, {{0, 2, 9, 4, 6}}, {0, 2, 4, 6}), 4u) << "two edges lead elsewhere, two are not run through";
    EXPECT_GT(gaps({fine}, {{6, 4, 2, 0}}, {0, 2, 4, 6}), 0u) << "the wrong way round";
    EXPECT_EQ(gaps({}, {fine}, {}), 8u) << "a closed surface has no rim";
}

TEST(Rims, TheShortestWayIsNotAlwaysAnEdgesOwn) {
    // Two holes touch at 0 and at 4, and from the one to the other their ways are long and short.
    const std::vector<Ring> fine = {{0, 1, 2, 3, 4, 5, 6, 7}, {0, 11, 4, 12, 13, 14}};
    EXPECT_EQ(gaps(fine, {{0, 4, 6}, {0, 11, 4, 13}}, {0, 4, 6, 11, 13}), 0u);
    EXPECT_EQ(gaps(fine, {{0, 4, 6}, {0, 4, 13}}, {0, 4, 6, 13}), 0u);
    EXPECT_EQ(gaps(fine, {{0, 4, 6}, {0, 11, 4, 9, 13}}, {0, 4, 6, 11, 13}), 4u);
    // Three edges, and two ways.
    EXPECT_GT(gaps(fine, {{0, 4, 6}, {0, 4, 13}, {0, 4, 6}}, {0, 4, 6, 13}), 0u);
}

TEST(Rims, WaysMakeRoomForEachOther) {
    // From 0 to 3 by 1 and 2, or by 4, 5 and 6; from 1 to 2 there is one.
    const std::vector<Ring> fine = {{0, 1, 2, 3, 10}, {0, 4, 5, 6, 3, 10}, {11, 1, 2, 12}, {11, 1, 4, 12}};
    EXPECT_EQ(gaps(fine, {{0, 3, 10}, {0, 5, 3, 10}, {11, 2, 12}, {11, 4, 12}}, {0, 3, 5, 10}), 0u);
}

TEST(Rims, RimsThatRunTheSameWayAreRunThroughAsOften) {
    const Ring fine = {0, 1, 2, 3, 4, 5};
    EXPECT_EQ(gaps({fine, fine}, {{0, 2, 4}, {1, 3, 5}}, fine), 0u);
    EXPECT_GT(gaps({fine}, {{0, 2, 4}, {1, 3, 5}}, fine), 0u);
}

TEST(Rims, HolesMayCloseToALine) {
    const Ring slit = {0, 1, 2, 3, 4, 5, 6, 7};
    EXPECT_EQ(gaps({slit}, {}, {0, 4}), 0u);
    // What lies between two holes that touch at 0 and at 4 is a line.
    EXPECT_EQ(gaps({{0, 1, 2, 3, 4, 5}, {4, 11, 0, 12}}, {{4, 5, 0, 12}}, {0, 4, 5, 12}), 0u);
}

TEST(Rims, WhatIsNotShownIsNotClosed) {
    const Ring hole = {0, 1, 2, 3, 4, 5, 6, 7}, other = {10, 11, 12, 13};
    EXPECT_EQ(gaps({hole, other}, {hole}, hole), 4u) << "a piece of the surface is missing";
    EXPECT_EQ(gaps({hole, other}, {other}, {0, 2, 4, 6, 10, 11, 12, 13}), 8u) << "a hole is filled";
}

}  // namespace
}  // namespace lodestone::tiles
