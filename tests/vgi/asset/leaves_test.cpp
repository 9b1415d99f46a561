// Leaves: the source's triangles below the finest samples.
#include "vgi/asset/leaves/leaves.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <map>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "mesh/topology.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/codec/leaf_codec.h"
#include "vgi/asset/error_codes.h"
#include "vgi/asset/leaves/leaf_demands.h"
#include "vgi/asset/pages.h"
#include "vgi/extract/extract.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

// Edges by their ends' places that are not met as often each way, and, unless they may lie on each other, those that
// are met more than once; of an edge on the end of a surface once is enough.
size_t bad_edges(const TriMesh& mesh, bool closed, bool may_coincide = false) {
    using Point = std::array<float, 3>;
    std::map<std::pair<Point, Point>, std::pair<int, int>> edges;
    const auto at = [&](size_t t, int k) {
        const glm::vec3& p = mesh.position_of(t, k % 3);
        return Point{p.x, p.y, p.z};
    };
    for (size_t t = 0; t < mesh.triangle_count(); ++t) {
        for (int k = 0; k < 3; ++k) {
            const Point a = at(t, k), b = at(t, k + 1);
            auto& [forth, back] = edges[std::minmax(a, b)];
            ++(a < b ? forth : back);
        }
    }
    size_t bad = 0;
    for (const auto& [ends, met] : edges) {
        bad += (!may_coincide && (met.first > 1 || met.second > 1)) || (closed && met.first != met.second);
    }
    return bad;
}

TEST(Leaves, AreTheSourceItself) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        for (const uint32_t cells : {8u, 64u}) {
            const Atlas atlas = small_atlas(f.mesh, cells, 8, true);
            ASSERT_TRUE(atlas.validate());
            ASSERT_TRUE(validate_leaves(atlas));
            for (uint32_t i = 0; i < atlas.leaves.size(); ++i) ASSERT_TRUE(atlas.has_leaf(i)) << i;
            const TriMesh source = extract_leaves(atlas);
            ASSERT_TRUE(source.validate());
            const Topology is = topology_of(source), was = topology_of(f.mesh);
            EXPECT_EQ(bad_edges(source, was.boundary_edges == 0), 0u) << cells;
            EXPECT_EQ(is.genus, was.genus);
            EXPECT_EQ(is.boundary_loops, was.boundary_loops);
            EXPECT_EQ(is.components, was.components);
            const auto diagonal = static_cast<double>(bounding_box(f.mesh.positions).diagonal());
            EXPECT_LT(surface_distance(f.mesh, source, {5000}).max(), 1e-6 * diagonal);
        }
    }
}

TEST(Leaves, AreDecodedAsTheyWereCoded) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 60000), 64, 8, true);
    size_t parts = 0;
    for (size_t p = 0; p < atlas.leaf_parts.size(); ++p) {
        const ByteLists::List coded = atlas.leaf_parts[p];
        const auto part = decode_leaf(coded, atlas.attributes);
        ASSERT_TRUE(part);
        EXPECT_TRUE(part->validate(atlas, 32));
        EXPECT_LE(part->triangles.size(), most_leaf_triangles);
        EXPECT_TRUE(std::ranges::equal(encode_leaf(*part, atlas.attributes), coded));
        ++parts;
        for (size_t cut = 0; cut < coded.size(); cut += 7)
            EXPECT_FALSE(decode_leaf(std::span(coded).first(cut), atlas.attributes));
    }
    EXPECT_GT(parts, atlas.leaves.size());
}

// Triangles by their corners' vertices, the lowest first, whatever order they are in.
std::vector<std::array<uint32_t, 9>> sorted_triangles(const LeafPart& part) {
    std::vector<std::array<uint32_t, 9>> sorted;
    for (const auto& t : part.triangles) {
        std::array<std::array<uint32_t, 3>, 3> corners{};
        for (size_t k = 0; k < 3; ++k) corners[k] = part.vertices[t[k]].position;
        std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
        std::array<uint32_t, 9> all{};
        for (size_t i = 0; i < 9; ++i) all[i] = corners[i / 3][i % 3];
        sorted.push_back(all);
    }
    std::ranges::sort(sorted);
    return sorted;
}

TEST(Leaves, AreCodedInAnyOrderAndSmallInOne) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 20000), 64, 8, true);
    Random random(5);
    size_t coded = 0, shuffled = 0, triangles = 0;
    for (uint32_t p = 0; p < atlas.leaf_parts.size(); ++p) {
        const LeafPart part = decoded_leaf(atlas, p);
        EXPECT_EQ(in_coding_order(part), part) << p;
        LeafPart other;
        std::vector<int> numbers(part.vertices.size(), -1);
        std::vector<std::array<uint8_t, 3>> order = part.triangles;
        for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
        for (auto t : order) {
            std::rotate(t.begin(), t.begin() + static_cast<ptrdiff_t>(random.below(3)), t.end());
            for (uint8_t& v : t) {
                if (numbers[v] < 0) {
                    numbers[v] = static_cast<int>(other.vertices.size());
                    other.vertices.push_back(part.vertices[v]);
                }
                v = static_cast<uint8_t>(numbers[v]);
            }
            other.triangles.push_back(t);
        }
        const auto bytes = encode_leaf(other, atlas.attributes);
        const auto same = decode_leaf(bytes, atlas.attributes);
        ASSERT_TRUE(same);
        EXPECT_EQ(*same, other) << p;
        const LeafPart again = in_coding_order(other);
        EXPECT_EQ(sorted_triangles(again), sorted_triangles(part)) << p;
        coded += encode_leaf(again, atlas.attributes).size();
        shuffled += bytes.size();
        triangles += part.triangles.size();
    }
    std::printf("%.2f bytes a triangle, %.2f in any order\n",
                static_cast<double>(coded) / static_cast<double>(triangles),
                static_cast<double>(shuffled) / static_cast<double>(triangles));
    EXPECT_LT(static_cast<double>(coded), 8.0 * static_cast<double>(triangles));
    EXPECT_LT(coded, shuffled);
}

// Whatever bytes there are, a part is one or is refused.
TEST(Leaves, AreRefusedWhereTheyAreDamaged) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 2000), 32, 4, true);
    Random random(1);
    for (int i = 0; i < 2000; ++i) {
        const auto whole =
            atlas.leaf_parts[static_cast<size_t>(random.unit() * static_cast<double>(atlas.leaf_parts.size()))];
        std::vector<std::byte> coded(whole.begin(), whole.end());
        for (int k = 0; k < 3; ++k)
            coded[static_cast<size_t>(random.unit() * static_cast<double>(coded.size()))] =
                static_cast<std::byte>(random.unit() * 256);
        const auto part = decode_leaf(coded, atlas.attributes);
        if (!part || !part->validate(atlas, 32)) continue;
        for (const auto& t : part->triangles) {
            for (const uint8_t v : t) EXPECT_LT(v, part->vertices.size());
        }
    }
}

// Beside samples, a side has samples and nothing else: whichever leaves are missing, what is left fits.
TEST(Leaves, FitSamplesWhereOthersAreMissing) {
    for (const auto& f : fixtures::manifold_meshes_and_shapes()) {
        SCOPED_TRACE(f.name);
        const Atlas whole = small_atlas(f.mesh, 64, 8, true);
        const bool closed = topology_of(f.mesh).boundary_edges == 0;
        for (uint64_t seed = 0; seed < 3; ++seed) {
            Atlas atlas = whole;
            Random random(seed);
            const double share = random.unit();
            atlas.leaf_parts = {};
            for (uint32_t i = 0; i < atlas.leaves.size(); ++i) {
                if (random.unit() < share) {
                    for (uint32_t p = whole.first_part(i); p < whole.leaves[i].parts_end; ++p)
                        atlas.leaf_parts.add(whole.leaf_parts[p]);
                }
                atlas.leaves[i].parts_end = static_cast<uint32_t>(atlas.leaf_parts.size());
            }
            EXPECT_TRUE(validate_leaves(atlas));
            // Two crossings may go to one sample.
            EXPECT_EQ(bad_edges(extract_leaves(atlas), closed, true), 0u) << seed;
        }
    }
}

// A control: with one point moved leaves do not fit.
// What leaves ask for is closed: in a square, and on a side as both squares have it.
TEST(Leaves, AskForSamplesWithAllAboveThem) {
    for (const uint32_t cells : {2u, 4u, 8u, 32u}) {
        SCOPED_TRACE(cells);
        const std::vector<uint8_t> bits = samples_beside_leaves(cells, {});
        const auto at = [&](GridPoint p) -> uint32_t {
            return bits[static_cast<size_t>(p.y) * (cells + 1) + static_cast<size_t>(p.x)];
        };
        const auto n = static_cast<int32_t>(cells);
        const Bintree tree{n};
        for (uint32_t depth = 0; depth + 1 < tree.depths(); ++depth) {
            tree.for_depth(depth, [&](GridPoint p) {
                tree.for_parents(p, [&](GridPoint q) { EXPECT_EQ(at(p) & ~at(q), 0u) << p.x << ", " << p.y; });
            });
        }
        for (int32_t k = 1; k < n; ++k) {
            for (uint32_t side = 0; side < 4; ++side) {
                const auto [x, y] = on_side(side, k, n);
                const uint32_t its = at({x, y}), next = (side + 1) % 4;
                EXPECT_NE(its >> side & 1, 0u);
                const auto [u, v] = on_side(next, n - k, n);
                EXPECT_EQ(its >> (4 + side) & 1, at({u, v}) >> (4 + (next + 1) % 4) & 1) << "the other way round";
                // What another side asks for here its corner does, too.
                EXPECT_LE(its >> next & 1, its >> (4 + next) & 1) << k;
                EXPECT_LE(its >> (side + 3) % 4 & 1, its >> (4 + side) & 1) << k;
                EXPECT_EQ(its >> (side + 2) % 4 & 1, 0u) << k;
            }
        }
    }
}

// A corner of squares is wanted wherever a leaf next to one of its squares is, however large the picture.
TEST(Leaves, AskForCornersFromAllAroundThem) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 128, 8, true);
    const LeafNeighbours neighbours(atlas);
    const LeafDemands demands(atlas, neighbours);
    const ErrorCodes codes(atlas.extent());
    const auto holds = [&](const Leaf& demand, const Leaf& leaf) {
        const double away = glm::distance(atlas.lattice_point(demand.position), atlas.lattice_point(leaf.position));
        return leaf.error == 0 || demand.radius == ErrorCodes::everywhere ||
               (demand.error >= leaf.error && static_cast<double>(codes.radius(demand.radius)) >=
                                                  static_cast<double>(codes.radius(leaf.radius)) + away);
    };
    size_t looked = 0;
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const uint32_t n = atlas.leaves_per_side(c);
        ASSERT_EQ(n, 4u);
        for (uint32_t i = 0; i < n * n; ++i) {
            for (uint32_t k = 0; k < 4; ++k) {
                const auto [dx, dy] = on_side(k, 0u, 1u);
                const uint32_t x = i % n + dx, y = i / n + dy;
                for (const uint32_t next : neighbours.around(atlas.leaf(c, i % n, i / n), k)) {
                    ASSERT_TRUE(holds(demands.of_square(atlas.leaf(c, i % n, i / n)), atlas.leaves[next]));
                    ASSERT_TRUE(holds(demands.of_chart(atlas, c), atlas.leaves[next]));
                    if (x % n == 0 && y % n == 0) continue;
                    ASSERT_TRUE(holds(demands.of_corner(c, x, y), atlas.leaves[next])) << c << ": " << x << ", " << y;
                    ++looked;
                }
            }
        }
    }
    EXPECT_GT(looked, 1000u);
}

TEST(Leaves, AreNotSaidToFitWhereOneIsWrong) {
    Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 64, 8, true);
    move_points(atlas, [](size_t p) { return p == 1; });
    EXPECT_FALSE(validate_leaves(atlas));
}

}  // namespace
}  // namespace lodestone::vgi
