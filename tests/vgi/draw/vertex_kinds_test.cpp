#include "vgi/draw/cut/vertex_kinds.h"

#include <gmock/gmock.h>

namespace lodestone::vgi {
namespace {

using testing::ElementsAre;

TEST(VertexKinds, ACornerOfAPageMayBeOneOfCharts) {
    for (const uint32_t page_cells : {4u, 32u}) {
        const uint32_t row = page_cells + 1, page = 7 * LODE_VGI_PAGE_TEXELS;
        uint32_t corners = 0;
        for (uint32_t place = 0; place < row * row; ++place)
            corners += kind_of(page + place, page_cells) == LODE_VGI_KIND_CORNERS;
        EXPECT_EQ(corners, 4u);
        for (const uint32_t place : {0u, page_cells, row * page_cells, row * row - 1})
            EXPECT_EQ(kind_of(page + place, page_cells), LODE_VGI_KIND_CORNERS) << place;
        EXPECT_EQ(kind_of(page + 1, page_cells), LODE_VGI_KIND_SAMPLES);
    }
    EXPECT_EQ(kind_of(LODE_VGI_LEAF | 5, 32), LODE_VGI_KIND_LEAVES);
    EXPECT_EQ(kind_of(LODE_VGI_CORNER | LODE_VGI_LEAF | 5, 32), LODE_VGI_KIND_CORNERS) << "any bits may follow";
}

TEST(VertexKinds, TrianglesOfOneKindFollowEachOtherInTheirOrder) {
    constexpr uint32_t leaf = LODE_VGI_LEAF, corner = LODE_VGI_CORNER;
    std::vector<uint32_t> list = {9};
    TrianglesByKind by_kind;
    const std::vector<uint32_t> triangles = {1, 2, 3, leaf | 4, leaf | 5, leaf | 6, 5,        leaf | 4, 6, corner | 1,
                                             2, 3, 3, 2,        4,        leaf | 1, leaf | 2, leaf | 3};
    const auto runs = by_kind.append(triangles, 32, list);
    ASSERT_EQ(runs.size(), 3u);
    EXPECT_EQ(runs[0].kinds, LODE_VGI_KIND_SAMPLES);
    EXPECT_EQ(runs[1].kinds, LODE_VGI_KIND_LEAVES);
    EXPECT_EQ(runs[2].kinds, every_kind);
    for (const auto& run : runs) EXPECT_EQ(run.words, 6u);
    EXPECT_THAT(list, ElementsAre(9, 1, 2, 3, 3, 2, 4, leaf | 4, leaf | 5, leaf | 6, leaf | 1, leaf | 2, leaf | 3, 5,
                                  leaf | 4, 6, corner | 1, 2, 3));
    list.clear();
    EXPECT_THAT(by_kind.append({}, 32, list), testing::IsEmpty());
}

}  // namespace
}  // namespace lodestone::vgi
