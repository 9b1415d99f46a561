// Charts that end at different depths.
#include "vgi/asset/sample_depths.h"

#include <gtest/gtest.h>

#include <unistd.h>
#include <bit>
#include <cmath>
#include <filesystem>
#include <set>

#include "base/random.h"
#include "mesh/distance/distance.h"
#include "mesh/repair.h"
#include "mesh/topology.h"
#include "vgi/asset/atlas_chunks.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/leaves/leaf_demands.h"
#include "vgi/asset/pages.h"
#include "vgi/asset/saturation.h"
#include "vgi/extract/extract.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

// Of all squares: calls visit(depths, square, its number).
template <class Visit>
void for_depths(const Atlas& about, const SampleDepths& depths, Visit&& visit) {
    for (uint32_t c = 0; c < about.charts(); ++c) {
        for_leaf_squares(about, c,
                         [&](const Atlas::Tile& square, uint32_t leaf) { visit(depths.of(leaf), square, leaf); });
    }
}

// Whatever depths charts have: both squares that have a side say the same of it, as coarse as either at least; and each
// sample that lies on a side as it says is there, as both charts tell.
TEST(SampleDepths, LeaveNoGapForAnyDepths) {
    Random random(3);
    for (const uint32_t cells : {8u, 32u, 128u}) {
        Atlas about = small_atlas(fixtures::repaired(Shape::rock, 6000), cells, 8, true);
        for (int i = 0; i < 20; ++i) {
            const uint32_t page = tree_of(about, Layer::geometry).cells_per_page();
            for (uint8_t& levels : about.unsampled_levels)
                levels = static_cast<uint8_t>(random.unit() * std::log2(page));
            ASSERT_TRUE(about.validate_depths());
            const SampleDepths depths(about);
            size_t on_sides = 0;
            std::vector<std::vector<bool>> absent;
            for (uint32_t c = 0; c < about.charts(); ++c) absent.push_back(absent_samples(about, depths, c));
            for_depths(about, depths, [&](const SquareDepths& of, const Atlas::Tile& square, uint32_t) {
                for (uint32_t s = 0; s < 4; ++s) {
                    EXPECT_GE(of.sides[s], about.unsampled_levels[square.chart]);
                    EXPECT_LE(std::abs(of.sides[s] - of.sides[(s + 1) % 4]), 1);
                    const LeafSide other = leaf_across(about, square, s);
                    if (other.leaf != ~0u) { EXPECT_EQ(of.sides[s], depths.of(other.leaf).sides[other.side]); }
                    for (uint32_t k = 0; k <= page; ++k) {
                        const auto [x, y] = on_side(s, k, page);
                        const bool there = k % (1u << of.sides[s]) == 0;
                        on_sides += there;
                        EXPECT_EQ(absent[square.chart][(square.y * page + y) * (about.cells_of(square.chart) + 1) +
                                                       square.x * page + x],
                                  !there);
                    }
                }
            });
            EXPECT_GT(on_sides, 0u);
        }
    }
}

// What leaves ask for is there, whatever depths charts have, with all above it.
TEST(SampleDepths, HaveWhatLeavesAskFor) {
    Random random(5);
    Atlas about = small_atlas(fixtures::repaired(Shape::rock, 6000), 64, 8, true);
    for (uint8_t& levels : about.unsampled_levels) levels = static_cast<uint8_t>(random.unit() * 5);
    const SampleDepths depths(about);
    const SamplesBesideLeaves beside(about, depths);
    const int32_t page = 32;
    const Bintree tree{page};
    std::set<uint32_t> bits;
    for_depths(about, depths, [&](const SquareDepths& of, const Atlas::Tile& square, uint32_t leaf) {
        const std::vector<bool> absent = absent_samples(about, depths, square.chart);
        const auto at = [&](GridPoint p) {
            return uint32_t{beside.at(leaf, static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y))};
        };
        for (uint32_t depth = 0; depth < tree.depths(); ++depth) {
            tree.for_depth(depth, [&](GridPoint p) {
                const uint32_t x = square.x * page + static_cast<uint32_t>(p.x),
                               y = square.y * page + static_cast<uint32_t>(p.y);
                if (at(p) != 0) { EXPECT_FALSE(absent[y * (about.cells_of(square.chart) + 1) + x]); }
                if (depth + 1 < tree.depths()) tree.for_parents(p, [&](GridPoint q) { EXPECT_EQ(at(p) & ~at(q), 0u); });
                bits.insert(at(p));
            });
        }
        for (uint32_t s = 0; s < 4; ++s) {
            const LeafSide other = leaf_across(about, square, s);
            for (int32_t k = 1; k < page; ++k) {
                const auto [x, y] = on_side(s, k, page);
                if (k % (1 << of.sides[s]) == 0) { EXPECT_NE(at({x, y}) >> s & 1, 0u); }
                if (other.leaf == ~0u) continue;
                // Around both corners both squares ask for the same.
                const auto [u, v] = on_side(other.side, page - k, page);
                const uint32_t its = beside.at(other.leaf, static_cast<uint32_t>(u), static_cast<uint32_t>(v));
                EXPECT_EQ(at({x, y}) >> (4 + s) & 1, its >> (4 + (other.side + 1) % 4) & 1);
                EXPECT_EQ(at({x, y}) >> (4 + (s + 1) % 4) & 1, its >> (4 + other.side) & 1);
                // What other sides ask for here the corners do, too.
                EXPECT_LE(at({x, y}) >> (s + 1) % 4 & 1, at({x, y}) >> (4 + (s + 1) % 4) & 1);
                EXPECT_LE(at({x, y}) >> (s + 3) % 4 & 1, at({x, y}) >> (4 + s) & 1);
            }
        }
    });
    EXPECT_GT(bits.size(), 10u);
}

class UnevenAtlas : public testing::TestWithParam<uint32_t> {
protected:
    const Atlas atlas_ = uneven_atlas(GetParam());
};
// Many charts of a page; few of several pages.
INSTANTIATE_TEST_SUITE_P(Of, UnevenAtlas, testing::Values(60, 4));

TEST_P(UnevenAtlas, IsValidAndHasManyDepths) {
    const auto good = atlas_.validate();
    ASSERT_TRUE(good) << good.error().message;
    ASSERT_TRUE(validate_errors(atlas_));
    ASSERT_TRUE(validate_leaves(atlas_));
    EXPECT_GE(std::set<uint8_t>(atlas_.unsampled_levels.begin(), atlas_.unsampled_levels.end()).size(), 3u);
    size_t uneven = 0;
    const SampleDepths depths(atlas_);
    for (uint32_t c = 0; c < atlas_.charts(); ++c) uneven += !depths.is_even(atlas_, c);
    EXPECT_GT(uneven, 3u);
    // Nothing says that it is there and is not, or the other way round.
    for (const uint8_t radius : {uint8_t{0}, uint8_t{ErrorCodes::absent}}) {
        Atlas broken = atlas_;
        const auto at = std::ranges::find_if(broken.sample_radii, [&](uint8_t is) {
            return (is == ErrorCodes::absent) != (radius == ErrorCodes::absent);
        });
        *at = radius;
        EXPECT_FALSE(validate_errors(broken)) << int{radius};
    }
}

TEST_P(UnevenAtlas, HasNoLeafThatGoesToSamplesThatAreNotThere) {
    Atlas broken = atlas_;
    for (uint8_t& levels : broken.unsampled_levels) ++levels;
    EXPECT_FALSE(validate_leaves(broken));
}

TEST_P(UnevenAtlas, ClosesAtEveryLevel) {
    const double diagonal = bounding_box(fixtures::uneven_rock().positions).diagonal();
    const TriMesh source = fixtures::uneven_rock();
    for (uint32_t level = 0; level < atlas_.levels(); ++level) {
        const TriMesh mesh = extract_samples(atlas_, level);
        ASSERT_TRUE(mesh.validate());
        EXPECT_EQ(mesh.triangle_count(), atlas_.triangles_at(level));
        const Topology t = topology_of(mesh);
        EXPECT_EQ(t.boundary_loops, 0u) << level;
        EXPECT_EQ(t.genus, 0) << level;
        EXPECT_TRUE(t.manifold()) << level;
        const double off = surface_distance(source, mesh).max();
        EXPECT_LE(off, 1.1 * static_cast<double>(atlas_.errors[level]) + 1e-6 * diagonal) << level;
    }
}

// No finer than triangles of the source: a chart has at most three quarters of a sample for each, but for the least
// that charts have.
TEST_P(UnevenAtlas, IsAsDeepAsTheSource) {
    size_t samples = 0;
    for (uint32_t c = 0; c < atlas_.charts(); ++c) {
        const uint32_t own = (atlas_.cells_of(c) >> atlas_.unsampled_levels[c]) + 1, least = GetParam() > 40 ? 3 : 9;
        uint64_t triangles = 0;
        for_leaf_squares(atlas_, c, [&](const Atlas::Tile&, uint32_t leaf) {
            for (uint32_t p = atlas_.first_part(leaf); p < atlas_.leaves[leaf].parts_end; ++p)
                triangles += triangles_in_leaf(atlas_.leaf_parts[p]);
        });
        // Pieces of triangles are more than these.
        if (own > least) { EXPECT_LE(own * own, 0.75 * static_cast<double>(triangles)) << c; }
        samples += own * own;
    }
    EXPECT_LE(samples, fixtures::uneven_rock().triangle_count());
}

TEST_P(UnevenAtlas, ComesBackFromItsFileBitForBit) {
    const auto path =
        std::filesystem::temp_directory_path() / ("lodestone-uneven-" + std::to_string(getpid()) + ".lode");
    auto writer = ChunkWriter::create(path, {});
    ASSERT_TRUE(writer);
    ASSERT_TRUE(write_chunks(atlas_, *writer));
    ASSERT_TRUE(writer->commit());
    const auto back = open_atlas(*ChunkFile::open(path));
    std::filesystem::remove(path);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->unsampled_levels, atlas_.unsampled_levels);
    EXPECT_EQ(back->positions, atlas_.positions);
    EXPECT_EQ(back->sample_errors, atlas_.sample_errors);
    EXPECT_EQ(back->sample_radii, atlas_.sample_radii);
    EXPECT_EQ(back->normals, atlas_.normals);
}

}  // namespace
}  // namespace lodestone::vgi
