#include "vgi/draw/cut/vertex_kinds.h"

#include <gmock/gmock.h>

namespace lodestone::vgi {
namespace {

TEST(VertexKinds, ACornerOfAPageMayBeOneOfCharts) {
    for (const uint32_t cells : {4u, 32u}) {
        const uint32_t row = cells + 1, page = 7 * LODE_VGI_PAGE_TEXELS(cells);
        uint32_t corners = 0;
        for (uint32_t place = 0; place < row * row; ++place)
            corners += kind_of(page + place, cells) == LODE_VGI_KIND_CORNER_SAMPLES;
        EXPECT_EQ(corners, 4u);
        for (const uint32_t place : {0u, cells, row * cells, row * row - 1})
            EXPECT_EQ(kind_of(page + place, cells), LODE_VGI_KIND_CORNER_SAMPLES) << place;
        EXPECT_EQ(kind_of(page + 1, cells), LODE_VGI_KIND_SAMPLES);
    }
    EXPECT_EQ(kind_of(LODE_VGI_LEAF | 5, 32), LODE_VGI_KIND_LEAVES);
    EXPECT_EQ(kind_of(LODE_VGI_LEAF | LODE_VGI_LEAF_MOVES | 5, 32), LODE_VGI_KIND_MOVING_LEAVES);
    EXPECT_EQ(kind_of(LODE_VGI_CORNER | LODE_VGI_LEAF | 5, 32), LODE_VGI_KIND_CORNERS) << "any bits may follow";
}

std::vector<uint32_t> triangles_of(uint32_t first, size_t count) {
    std::vector<uint32_t> all;
    for (uint32_t i = first; i < first + 3 * count; ++i) all.push_back(i);
    return all;
}
std::vector<uint32_t> all_of(std::initializer_list<std::vector<uint32_t>> lists) {
    std::vector<uint32_t> all;
    for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
    return all;
}

TEST(VertexKinds, LongRunsOfOneKindFollowEachOtherInTheirOrder) {
    const std::vector<uint32_t> samples = triangles_of(40, 20), more_samples = triangles_of(140, 16),
                                few_samples = triangles_of(240, 15);
    const std::vector<uint32_t> leaves = triangles_of(LODE_VGI_LEAF, 30),
                                few_leaves = triangles_of(LODE_VGI_LEAF | 256, 2),
                                moving = triangles_of(LODE_VGI_LEAF | LODE_VGI_LEAF_MOVES, 20);
    const std::vector<uint32_t> corners = triangles_of(LODE_VGI_CORNER, 16), corner = {LODE_VGI_CORNER | 1, 2, 3},
                                mixed = {5, LODE_VGI_LEAF | 4, 6};
    // 0 is in the corner of a page.
    const std::vector<uint32_t> page_corner = {0, 1, 2};
    const std::vector<uint32_t> all = all_of({samples, page_corner, few_samples, corners, leaves, few_samples, moving,
                                              corner, more_samples, mixed, few_leaves});
    std::vector<TrianglesByKind::Run> runs;
    const auto ordered = [&](const std::vector<uint32_t>& triangles, bool told_apart) {
        TrianglesByKind by_kind(triangles, 32, told_apart);
        for (size_t c = by_kind.chunks(); c-- > 0;) by_kind.look_at(c);
        runs = by_kind.runs();
        std::vector<uint32_t> list(triangles.size());
        for (size_t c = by_kind.chunks(); c-- > 0;) by_kind.copy(c, list.data());
        return list;
    };
    const std::vector<uint32_t> list = ordered(all, true);
    const auto expect_run = [&](size_t at, uint32_t kinds, uint32_t triangles) {
        EXPECT_EQ(runs[at].kinds, kinds) << at;
        EXPECT_EQ(runs[at].words, 3 * triangles) << at;
    };
    ASSERT_EQ(runs.size(), 6u);
    expect_run(0, LODE_VGI_KIND_SAMPLES, 36);
    expect_run(1, kinds_of_samples, 16);
    expect_run(2, LODE_VGI_KIND_LEAVES, 30);
    expect_run(3, LODE_VGI_KIND_MOVING_LEAVES, 20);
    expect_run(4, LODE_VGI_KIND_CORNERS, 16);
    expect_run(5, every_kind, 19);
    EXPECT_EQ(list, all_of({samples, more_samples, page_corner, few_samples, leaves, moving, corners, few_samples,
                            corner, mixed, few_leaves}));
    EXPECT_EQ(ordered(all, false), all);
    ASSERT_EQ(runs.size(), 1u);
    EXPECT_EQ(runs[0].kinds, every_kind);
    EXPECT_EQ(runs[0].words, all.size());
    EXPECT_TRUE(ordered({}, true).empty());
    EXPECT_TRUE(runs.empty());
    // However short, where there is nothing else.
    EXPECT_EQ(ordered(few_leaves, true), few_leaves);
    ASSERT_EQ(runs.size(), 1u);
    expect_run(0, LODE_VGI_KIND_LEAVES, 2);
    // Of several chunks.
    std::vector<uint32_t> much, much_of_samples, much_of_leaves;
    const auto append = [](std::vector<uint32_t>& to, const std::vector<uint32_t>& more) {
        to.insert(to.end(), more.begin(), more.end());
    };
    for (int i = 0; i < 1000; ++i) {
        append(much, samples);
        append(much, leaves);
        append(much_of_samples, samples);
        append(much_of_leaves, leaves);
    }
    EXPECT_EQ(ordered(much, true), all_of({much_of_samples, much_of_leaves}));
    EXPECT_EQ(runs.size(), 2u);
}

}  // namespace
}  // namespace lodestone::vgi
