#include "vgi/bake/images/sample_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <glm/geometric.hpp>
#include <numeric>
#include <set>

#include "base/random.h"
#include "fixtures/meshes.h"
#include "mesh/distance/distance.h"
#include "mesh/generate.h"
#include "mesh/repair.h"
#include "vgi/asset/bintree.h"
#include "vgi/asset/pages.h"
#include "vgi/bake/images/corners/collapse_corners.h"
#include "vgi/extract/extract.h"
#include "vgi/small_atlas.h"

namespace lodestone::vgi {
namespace {

TEST(Bintree, HasEverySampleOnceAndItsParentsOneDepthUp) {
    for (const int32_t cells : {2, 8, 32}) {
        const Bintree tree{cells};
        std::set<std::pair<int32_t, int32_t>> seen;
        for (uint32_t depth = 0; depth < tree.depths(); ++depth) {
            tree.for_depth(depth, [&](GridPoint p) {
                EXPECT_TRUE(seen.insert({p.x, p.y}).second);
                EXPECT_EQ(tree.depth(p), depth);
                const auto [a, b] = tree.hypotenuse(p);
                EXPECT_EQ(a.x + b.x, 2 * p.x);
                EXPECT_EQ(a.y + b.y, 2 * p.y);
                uint32_t parents = 0;
                tree.for_parents(p, [&](GridPoint q) {
                    ++parents;
                    if (tree.is_corner(q)) {
                        EXPECT_EQ(depth + 1, tree.depths());
                        return;
                    }
                    EXPECT_EQ(tree.depth(q), depth + 1);
                    bool is_child = false;
                    tree.for_children(q, [&](GridPoint c) { is_child = is_child || c == p; });
                    EXPECT_TRUE(is_child);
                });
                const bool rim = p.x == 0 || p.y == 0 || p.x == cells || p.y == cells;
                EXPECT_EQ(parents, rim ? 1u : 2u);
            });
        }
        EXPECT_EQ(seen.size(), static_cast<size_t>(cells + 1) * static_cast<size_t>(cells + 1) - 4);
    }
}

TEST(ErrorCodes, RoundUp) {
    const ErrorCodes codes(5.0);
    EXPECT_EQ(codes.of_error(0), 0);
    EXPECT_EQ(codes.error(0), 0);
    for (double error = 5; error > 1e-8; error *= 0.73) {
        const float back = codes.error(codes.of_error(error));
        EXPECT_GE(back, static_cast<float>(error));
        EXPECT_LE(back, static_cast<float>(error) * 1.0906f);
        EXPECT_GE(codes.radius(codes.of_radius(error)), static_cast<float>(error));
    }
}

TEST(ErrorCodes, OfLatticeDistancesAreThoseOfErrors) {
    // Object units of a step of the lattice each.
    const ErrorCodes codes(65535 * std::sqrt(3.0));
    EXPECT_EQ(error_code_of_squared(0), 0);
    EXPECT_EQ(error_code_of_squared(1e-30), 1);
    for (double error = 110000; error > 1e-4; error *= 0.9731)
        EXPECT_EQ(error_code_of_squared(error * error), codes.of_error(error)) << error;
    EXPECT_EQ(round_up(0, 0), 0);
    EXPECT_EQ(round_up(1, 0), 4);
    EXPECT_EQ(round_up(4, 0), 4);
    EXPECT_EQ(round_up(253, 0), 255);
    EXPECT_EQ(round_up(5, 1), 6);
    EXPECT_EQ(round_up(5, 2), 5);
}

TEST(SampleErrors, AreSaturatedAndSharedOnAnyMesh) {
    auto meshes = fixtures::manifold_meshes();
    meshes.push_back({"rock", fixtures::repaired(Shape::rock, 6000)});
    meshes.push_back({"terrain", fixtures::repaired(Shape::terrain, 4000)});
    for (const auto& f : meshes) {
        SCOPED_TRACE(f.name);
        const Atlas atlas = small_atlas(f.mesh, 64);
        const auto valid = validate_errors(atlas);
        EXPECT_TRUE(valid) << valid.error().message;
        EXPECT_TRUE(atlas.validate());
    }
}

TEST(SampleErrors, AreTheSameWithLeaves) {
    const TriMesh rock = fixtures::repaired(Shape::rock, 6000);
    for (const uint32_t cells : {16u, 64u}) {
        const Atlas with = small_atlas(rock, cells, 8, true), without = small_atlas(rock, cells, 8, false);
        // Without leaves finest errors are rounded up: by 3 codes, those above them by 3, 1 and 1 more.
        ASSERT_EQ(with.positions, without.positions);
        for (size_t t = 0; t < with.texels(); ++t) {
            ASSERT_LE(with.sample_errors[t], without.sample_errors[t]) << cells;
            ASSERT_GE(with.sample_errors[t] + 8, without.sample_errors[t]) << cells;
        }
        Atlas broken = with;
        EXPECT_TRUE(validate_errors(broken));
        for (Leaf& leaf : broken.leaves) leaf.error = static_cast<uint8_t>(std::min(255, leaf.error + 60));
        const auto wrong = validate_errors(broken);
        ASSERT_FALSE(wrong);
        EXPECT_THAT(wrong.error().message, testing::HasSubstr("is not saturated by leaves"));
    }
}

std::vector<uint32_t> vertices_of(const TriMesh& mesh) {
    std::vector<uint32_t> indices;
    for (size_t t = 0; t < mesh.triangle_count(); ++t)
        for (int k = 0; k < 3; ++k) indices.push_back(mesh.vertex_of(t, k));
    return indices;
}

TEST(SampleErrors, HoldFromTheTrianglesToTheSurfaceToo) {
    // What a cut draws in place of a sample is no farther from the surface than the sample's error says, wherever on
    // the triangle one looks: between the places the errors were measured at, a tenth is allowed.
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 20000), 64);
    const TriMesh finest = extract_samples(atlas, 0);
    const ClosestSurface surface(finest.positions, vertices_of(finest));
    const ErrorCodes codes(atlas.extent());
    const Bintree tree{static_cast<int32_t>(atlas.cells)};
    const double finest_error = static_cast<double>(atlas.errors[0]);
    Random random(3);
    size_t looked = 0, beyond = 0;
    double worst = 0;
    for (uint32_t chart = 0; chart < atlas.charts(); chart += 2) {
        const auto at = [&](GridPoint p) {
            return atlas.point(atlas.texel(chart, static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y)));
        };
        for (uint32_t depth = 0; depth + 1 < tree.depths(); ++depth) {
            tree.for_depth(depth, [&](GridPoint m) {
                const auto ends = tree.hypotenuse(m);
                tree.for_parents(m, [&](GridPoint apex) {
                    const size_t texel = atlas.texel(chart, static_cast<uint32_t>(m.x), static_cast<uint32_t>(m.y));
                    const double error = static_cast<double>(codes.error(atlas.sample_errors[texel]));
                    double distance = 0;
                    for (uint32_t i = 0; i < 1 + (1u << depth) / 4; ++i) {
                        const double s = random.unit(), r = random.unit() * (1 - s);
                        const glm::dvec3 p = at(ends[0]) * (1 - s - r) + at(ends[1]) * s + at(apex) * r;
                        distance = std::max(distance, surface.closest(p).distance);
                    }
                    const double ratio = (distance - 0.1 * finest_error) / error;
                    ++looked;
                    beyond += ratio > 1;
                    worst = std::max(worst, ratio);
                });
            });
        }
    }
    EXPECT_GT(looked, 50000u);
    EXPECT_LT(worst, 1.1);
    EXPECT_LE(beyond, 5u);
}

TEST(SampleErrors, HoldToTheSourceWhereSamplesAreFew) {
    // The same to the source itself, which the finest samples are far from: what is drawn over one of its vertices may
    // be off most.
    const TriMesh source = fixtures::repaired(Shape::rock, 60000);
    const Atlas atlas = small_atlas(source, 16, 16, true);
    const ClosestSurface surface(source.positions, vertices_of(source));
    const ErrorCodes codes(atlas.extent());
    const Bintree tree{static_cast<int32_t>(atlas.cells)};
    Random random(5);
    // Of the finest depth triangles are hardly larger than the source's; and below there are leaves.
    struct Depth {
        size_t looked = 0, beyond = 0;  // by more than a twentieth
        double worst = 0;
    };
    std::vector<Depth> depths(tree.depths());
    for (uint32_t chart = 0; chart < atlas.charts(); ++chart) {
        const auto at = [&](GridPoint p) {
            return atlas.point(atlas.texel(chart, static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y)));
        };
        for (uint32_t depth = 0; depth < tree.depths(); ++depth) {
            tree.for_depth(depth, [&](GridPoint m) {
                const auto ends = tree.hypotenuse(m);
                const size_t texel = atlas.texel(chart, static_cast<uint32_t>(m.x), static_cast<uint32_t>(m.y));
                const double error = static_cast<double>(codes.error(atlas.sample_errors[texel]));
                tree.for_parents(m, [&](GridPoint apex) {
                    double distance = 0;
                    for (int i = 0; i < 60; ++i) {
                        const double s = random.unit(), r = random.unit() * (1 - s);
                        const glm::dvec3 p = at(ends[0]) * (1 - s - r) + at(ends[1]) * s + at(apex) * r;
                        distance = std::max(distance, surface.closest(p).distance);
                    }
                    ++depths[depth].looked;
                    depths[depth].beyond += distance > 1.05 * error;
                    depths[depth].worst = std::max(depths[depth].worst, distance / error);
                });
            });
        }
    }
    for (uint32_t depth = 0; depth < tree.depths(); ++depth) {
        const auto& [looked, beyond, worst] = depths[depth];
        SCOPED_TRACE(depth);
        EXPECT_EQ(looked, size_t{atlas.charts()} << (tree.depths() - depth));
        const double allowed = depth == 0 ? 0.06 : depth == 1 ? 0.003 : depth == 2 ? 0.001 : 0;
        EXPECT_LE(static_cast<double>(beyond), allowed * static_cast<double>(looked)) << looked;
        // An error of nearly nothing may be wrong by any factor.
        EXPECT_LT(worst, depth == 0 ? 20 : depth == 1 ? 1.3 : 1.15);
    }
}

TEST(SampleErrors, ValidationNoticesWhatIsBroken) {
    const Atlas good = small_atlas(fixtures::repaired(Shape::rock, 6000), 64);
    ASSERT_TRUE(validate_errors(good));
    Atlas bad = good;
    bad.sample_errors[bad.texel(0, 32, 32)] = 1;
    EXPECT_THAT(validate_errors(bad).error().message, testing::HasSubstr("not saturated"));
    bad = good;
    bad.sample_radii.assign(bad.sample_radii.size(), 2);
    EXPECT_THAT(validate_errors(bad).error().message, testing::HasSubstr("not saturated"));
    bad = good;
    bad.bounds[0].radius *= 0.5f;
    EXPECT_THAT(validate_errors(bad).error().message, testing::HasSubstr("outside its sphere"));
    bad = good;
    --bad.bounds[2].sample_error;
    EXPECT_THAT(validate_errors(bad).error().message, testing::HasSubstr("larger code"));
    bad = good;
    bad.bounds[3].error = 10 * bad.bounds[0].error;
    EXPECT_THAT(validate_errors(bad).error().message, testing::HasSubstr("larger error"));
    bad = good;
    const GluedSide other = bad.sides[0];
    const auto [x, y] = on_side(other.side, 5u, bad.cells);
    ++bad.sample_errors[bad.texel(other.chart, x, y)];
    EXPECT_THAT(bad.validate().error().message, testing::HasSubstr("differs"));
}

TEST(SampleErrors, OfLevelsAndPagesAreBoundsOnRealDistances) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 6000);
    const Atlas atlas = small_atlas(mesh, 64);
    const PageTree tree{atlas.cells};
    for (uint32_t level = 0; level <= tree.base_level(); ++level) {
        double largest = 0;
        for (uint32_t c = 0; c < atlas.charts(); ++c) {
            for (uint32_t i = 0; i < tree.pages_per_side(level) * tree.pages_per_side(level); ++i) {
                const uint32_t page = tree.page(level, i % tree.pages_per_side(level), i / tree.pages_per_side(level));
                largest = std::max<double>(largest, atlas.bounds[size_t{c} * tree.pages() + page].error);
            }
        }
        EXPECT_LE(surface_distance(mesh, extract_samples(atlas, level)).max(), 1.1 * largest) << level;
        EXPECT_LE(largest, static_cast<double>(atlas.errors[level]));
    }
}

TEST(SampleErrors, ConesHoldTheNormalsOfEveryTriangleThatMayBeDrawn) {
    const Atlas atlas = small_atlas(fixtures::repaired(Shape::sphere, 20000), 64);
    const PageTree tree{atlas.cells};
    const Bintree bintree{static_cast<int32_t>(atlas.cells)};
    uint32_t cones = 0;
    for (uint32_t c = 0; c < atlas.charts(); ++c) {
        const PageBounds& base = atlas.bounds[size_t{c} * tree.pages()];
        if (base.cosine == -127) continue;
        ++cones;
        const glm::dvec3 axis = glm::normalize(glm::dvec3(base.axis[0], base.axis[1], base.axis[2]));
        const auto at = [&](GridPoint p) {
            return atlas.point(atlas.texel(c, static_cast<uint32_t>(p.x), static_cast<uint32_t>(p.y)));
        };
        for (uint32_t depth = 0; depth < bintree.depths(); ++depth) {
            bintree.for_depth(depth, [&](GridPoint p) {
                const auto ends = bintree.hypotenuse(p);
                const GridPoint &a = ends[0], &b = ends[1];
                bintree.for_parents(p, [&](GridPoint apex) {
                    // Both triangles turn the same way in the square; the turn tells which way round.
                    const int32_t turn = (b.x - a.x) * (apex.y - a.y) - (b.y - a.y) * (apex.x - a.x);
                    glm::dvec3 normal = glm::cross(at(b) - at(a), at(apex) - at(a));
                    if (turn < 0) normal = -normal;
                    ASSERT_GE(glm::dot(glm::normalize(normal), axis), base.cosine / 127.0 - 1e-12);
                });
            });
        }
    }
    EXPECT_GT(cones, atlas.charts() / 2);
}

TEST(CornerErrors, AreLeftAsTheyAreWhereTheBakeIsToStop) {
    Atlas atlas = small_atlas(fixtures::repaired(Shape::rock, 6000), 16, 24);
    const auto before = atlas.chart_corners;
    const size_t corners = atlas.corners.size();
    ASSERT_FALSE(before.empty());
    atlas.chart_corners.clear();
    const std::atomic<bool> stop{true};
    Progress progress;
    progress.stop = &stop;
    collapse_corners(atlas, progress);
    EXPECT_TRUE(atlas.chart_corners.empty());
    EXPECT_EQ(atlas.corners.size(), corners);
    collapse_corners(atlas);
    EXPECT_EQ(atlas.chart_corners, before);
}

// What is drawn of charts that have not all four corners, where only so many of the first are wanted: three of these
// corners per triangle.
std::vector<uint32_t> corners_alone(const Atlas& atlas, uint32_t wanted) {
    std::vector<uint32_t> indices;
    const auto drawn = [&](uint32_t corner) {
        while (corner >= wanted && atlas.corners[corner].parent != corner) corner = atlas.corners[corner].parent;
        return corner;
    };
    for (const auto& corners : atlas.chart_corners) {
        if (std::ranges::all_of(corners, [&](uint32_t corner) { return corner < wanted; })) continue;
        for (const auto& k : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
            const uint32_t a = drawn(corners[static_cast<size_t>(k[0])]), b = drawn(corners[static_cast<size_t>(k[1])]),
                           c = drawn(corners[static_cast<size_t>(k[2])]);
            if (a != b && b != c && c != a) indices.insert(indices.end(), {a, b, c});
        }
    }
    return indices;
}

TEST(CornerErrors, HoldAnywhereOnWhatIsDrawn) {
    // Whichever are wanted, no triangle is farther from the surface than the first that is not wanted says: between the
    // places where it was measured, a tenth is allowed.
    for (const Shape shape : {Shape::rock, Shape::cliff, Shape::torus}) {
        const Atlas atlas = small_atlas(fixtures::repaired(shape, 20000), 8, 120);
        const TriMesh finest = extract_samples(atlas, 0);
        const ClosestSurface surface(finest.positions, vertices_of(finest));
        const ErrorCodes codes(atlas.extent());
        Random random(5);
        double worst = 0;
        for (uint32_t wanted = 4; wanted < atlas.corners.size(); ++wanted) {
            if (atlas.corners[wanted].error == atlas.corners[wanted - 1].error) continue;
            const std::vector<uint32_t> drawn = corners_alone(atlas, wanted);
            const double error = static_cast<double>(codes.error(atlas.corners[wanted].error));
            for (size_t i = 0; i < drawn.size(); i += 3) {
                const auto at = [&](size_t k) { return atlas.lattice_point(atlas.corners[drawn[i + k]].position); };
                for (int n = 0; n < 20; ++n) {
                    const double s = random.unit(), r = random.unit() * (1 - s);
                    const glm::dvec3 p = at(0) * (1 - s - r) + at(1) * s + at(2) * r;
                    worst = std::max(worst, surface.closest(p).distance / error);
                }
            }
        }
        EXPECT_LT(worst, 1.1) << static_cast<int>(shape);
    }
}

// Corners whose errors have a code, half way from where their parents are, and which halves of charts move with them.
struct HalfWay {
    HalfWay(const Atlas& atlas, uint8_t code) : atlas(atlas) {
        for (uint32_t i = 0; i < atlas.corners.size(); ++i) {
            const Corner& corner = atlas.corners[i];
            const glm::dvec3 own = atlas.lattice_point(corner.position);
            const bool is_root = corner.parent == i;
            wanted.push_back(is_root || corner.error >= code ? i : wanted[corner.parent]);
            moves.push_back(!is_root && corner.error <= code && (corner.error == code || moves[corner.parent]));
            at.push_back(is_root || corner.error > code ? own
                         : corner.error == code         ? 0.5 * (own + at[corner.parent])
                                                        : at[corner.parent]);
        }
    }
    // Calls visit(chart, its corners) for the halves of all charts.
    template <class Visit>
    void for_halves(Visit&& visit) const {
        for (uint32_t c = 0; c < atlas.charts(); ++c) {
            const auto& k = atlas.chart_corners[c];
            for (const auto& half : {std::array{k[0], k[1], k[2]}, std::array{k[0], k[2], k[3]}}) visit(c, half);
        }
    }
    bool is_flat(const std::array<uint32_t, 3>& half) const {
        const uint32_t a = wanted[half[0]], b = wanted[half[1]], c = wanted[half[2]];
        return a == b || b == c || c == a;
    }
    bool is_moved(const std::array<uint32_t, 3>& half) const {
        return std::ranges::any_of(half, [&](uint32_t corner) { return moves[corner]; });
    }

    const Atlas& atlas;
    std::vector<uint32_t> wanted;  // per corner: in whose place it is drawn, were none on its way
    std::vector<bool> moves;
    std::vector<glm::dvec3> at;
};

// The largest distance of moving triangles to the surface, and of the corners and centres of charts that they stand for
// to what is drawn; over the error.
double worst_half_way(const Atlas& atlas, const ClosestSurface& surface, uint8_t code) {
    const HalfWay drawn(atlas, code);
    std::vector<glm::vec3> corners;
    drawn.for_halves([&](uint32_t, const std::array<uint32_t, 3>& half) {
        if (drawn.is_flat(half)) return;
        for (const uint32_t corner : half) corners.emplace_back(drawn.at[corner]);
    });
    if (corners.empty()) return 0;
    std::vector<uint32_t> indices(corners.size());
    std::iota(indices.begin(), indices.end(), 0u);
    const ClosestSurface of_drawn(corners, indices);
    Random random(5);
    double worst = 0;
    drawn.for_halves([&](uint32_t chart, const std::array<uint32_t, 3>& half) {
        if (!drawn.is_moved(half)) return;
        for (int n = 0; n < 20 && !drawn.is_flat(half); ++n) {
            const double s = random.unit(), r = random.unit() * (1 - s);
            const auto at = [&](size_t k) { return drawn.at[half[k]]; };
            worst = std::max(worst, surface.closest(at(0) * (1 - s - r) + at(1) * s + at(2) * r).distance);
        }
        const uint32_t cells = atlas.cells_of(chart);
        worst = std::max(worst, of_drawn.closest(atlas.point(atlas.texel(chart, cells / 2, cells / 2))).distance);
        for (const uint32_t corner : half)
            worst = std::max(worst, of_drawn.closest(atlas.lattice_point(atlas.corners[corner].position)).distance);
    });
    return worst / static_cast<double>(ErrorCodes(atlas.extent()).error(code));
}

TEST(CornerErrors, HoldWhileCornersAreOnTheirWay) {
    // Of collapses as they are measured one by one, 1.11 and 1.05.
    for (const auto& [shape, clusters] : {std::pair(Shape::terrain, 80u), {Shape::rock, 220u}}) {
        const Atlas atlas = small_atlas(fixtures::repaired(shape, 20000), 8, clusters);
        const TriMesh finest = extract_samples(atlas, 0);
        const ClosestSurface surface(finest.positions, vertices_of(finest));
        double worst = 0;
        for (int code = 1; code < 255; ++code)
            worst = std::max(worst, worst_half_way(atlas, surface, static_cast<uint8_t>(code)));
        EXPECT_GT(worst, 0.5) << static_cast<int>(shape);
        EXPECT_LT(worst, 1) << static_cast<int>(shape);
    }
}

}  // namespace
}  // namespace lodestone::vgi
