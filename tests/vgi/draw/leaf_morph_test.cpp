#include "vgi/draw/leaves/leaf_morph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/distance/distance.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/pages.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

TEST(LeafMorph, IsWithinAThirtiethOfItsLongestCoordinateAndPacksAsItIs) {
    Random random(3);
    for (int i = 0; i < 10000; ++i) {
        const auto unit = [&] { return random.unit() * 2 - 1; };
        const glm::dvec3 start = glm::dvec3(unit(), unit(), unit()) * std::exp2(random.unit() * 20);
        const double longest = std::max({std::abs(start.x), std::abs(start.y), std::abs(start.z)});
        const LeafMorph morph = leaf_morph(start, static_cast<uint8_t>(i % 5));
        EXPECT_EQ(LeafMorph::unpacked(morph.packed()), morph);
        for (int k = 0; k < 3; ++k)
            EXPECT_LE(std::abs(static_cast<double>(morph.start()[k]) - start[k]), std::max(longest / 30, 0.5));
    }
    EXPECT_EQ(leaf_morph(glm::dvec3(0), 0).packed(), 0u);
}

// All vertices of all leaves: visit(vertex, its morph, the leaf).
template <class Visit>
void for_morphs(const Atlas& atlas, const Visit& visit) {
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const PageTree tree = tree_of(atlas, Layer::geometry, c);
        const uint32_t per_side = atlas.leaves_per_side(c), n = tree.cells_per_page();
        for (uint32_t i = 0; i < per_side * per_side; ++i) {
            const Atlas::Tile square{c, i % per_side, i / per_side};
            std::vector<LeafSample> samples;
            for (uint32_t y = square.y * n; y <= (square.y + 1) * n; ++y) {
                for (uint32_t x = square.x * n; x <= (square.x + 1) * n; ++x) {
                    const size_t t = atlas.texel(c, x, y);
                    samples.push_back({atlas.positions[t], atlas.sample_errors[t]});
                }
            }
            const uint32_t leaf = atlas.leaf(c, square.x, square.y);
            for (uint32_t p = atlas.first_part(leaf); p < atlas.leaves[leaf].parts_end; ++p) {
                const LeafPart part = decoded_leaf(atlas, p);
                const auto morphs = leaf_morphs(atlas, square, part, samples);
                for (size_t v = 0; v < part.vertices.size(); ++v)
                    visit(part.vertices[v], morphs[v], atlas.leaves[leaf]);
            }
        }
    }
}

TEST(LeafMorph, StartsOffTheSourceByNoMoreThanTheLeafsError) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 6000);
    const Atlas atlas = small_atlas(mesh, 64, 8, true);
    const ErrorCodes codes(atlas.extent());
    std::vector<uint32_t> corners;
    for (const auto& t : mesh.triangles) {
        for (const uint32_t w : t) corners.push_back(mesh.wedge_vertex[w]);
    }
    const ClosestSurface source(mesh.positions, corners);
    size_t moving = 0;
    double most = 0;
    for_morphs(atlas, [&](const LeafVertex& v, const LeafMorph& morph, const Leaf& leaf) {
        const glm::dvec3 off(morph.start());
        const glm::dvec3 start = atlas.leaf_point(v.position) + atlas.step / (1u << atlas.leaf_shift) * off;
        const double error = static_cast<double>(codes.error(leaf.error));
        const double rounding = atlas.step + glm::length(off) * atlas.step / (1u << atlas.leaf_shift) / 16;
        most = std::max(most, (source.closest(start).distance - rounding) / error);
        moving += glm::length(off) * atlas.step / (1u << atlas.leaf_shift) > error / 4;
        EXPECT_TRUE(!v.is_corner() || morph.off == (std::array<int8_t, 3>{}));
    });
    EXPECT_LE(most, 1);
    EXPECT_GT(moving, 100u);
}

}  // namespace
}  // namespace lodestone::vgi
