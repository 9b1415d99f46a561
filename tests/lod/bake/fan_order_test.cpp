#include "lod/bake/orders/fan_order.h"
#include "lod/bake/simplify/simplifier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <numeric>

#include "fixtures/faces.h"
#include "fixtures/meshes.h"
#include "fixtures/real_data.h"
#include "lod/bake/bake.h"
#include "lod/bake/orders/order_statistics.h"
#include "mesh/cache/tipsify.h"
#include "mesh/generate.h"
#include "mesh/repair.h"

namespace lodestone {
namespace {

using fixtures::indices_of;

std::vector<uint32_t> drawn(const std::vector<uint32_t>& indices, const std::vector<uint32_t>& order) {
    std::vector<uint32_t> out;
    for (const uint32_t f : order) out.insert(out.end(), {indices[3 * f], indices[3 * f + 1], indices[3 * f + 2]});
    return out;
}

TEST(FanOrder, IsAPermutationWithAndWithoutLookingAhead) {
    for (const auto& f : fixtures::manifold_meshes()) {
        SCOPED_TRACE(f.name);
        auto indices = indices_of(f.mesh);
        indices.insert(indices.end(), {0, 0, 1, 2, 2, 2});  // dead faces
        const auto vertices = static_cast<uint32_t>(f.mesh.wedge_count());
        for (const uint32_t candidates : {1u, 3u}) {
            auto order = fan_order(Fans(indices, vertices), 16, {}, {candidates, 20, 2});
            ASSERT_EQ(order.size(), indices.size() / 3);
            std::sort(order.begin(), order.end());
            for (uint32_t i = 0; i < order.size(); ++i) ASSERT_EQ(order[i], i);
        }
    }
}

TEST(FanOrder, EndsSoonWhereItIsStopped) {
    TriMesh mesh = generate(Shape::rock, 2000, 1);
    ASSERT_TRUE(repair(mesh));
    const auto indices = indices_of(mesh);
    std::atomic<bool> stop = true;
    Fans fans(indices, static_cast<uint32_t>(mesh.wedge_count()));
    fans.stop = &stop;
    std::vector<uint32_t> as_they_lie(indices.size() / 3);
    std::iota(as_they_lie.begin(), as_they_lie.end(), 0u);
    EXPECT_EQ(fan_order(fans, 16, {}, {4, 60, 2}), as_they_lie);
    stop = false;
    EXPECT_NE(fan_order(fans, 16, {}, {4, 60, 2}), as_they_lie);
}

TEST(KeyframeOrder, StoppedWorkIsNoOrder) {
    TriMesh mesh = generate(Shape::rock, 2000, 1);
    ASSERT_TRUE(repair(mesh));
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    ASSERT_TRUE(list);
    std::atomic<bool> stop = true;
    Progress progress;
    progress.stop = &stop;
    // What comes before the orders ends, too.
    progress.report = [](const std::string& stage, double) { ADD_FAILURE() << "went on to " << stage; };
    for (const char* order : {"keyframe", "greedy", "static"}) {
        const auto pm = bake_progressive_mesh(mesh, *list, {order}, {}, progress);
        ASSERT_FALSE(pm) << order;
        EXPECT_EQ(pm.error().fault, Fault::interrupted);
    }
}

TEST(FanOrder, BeatsTipsifyAndLookingAheadBeatsFanOrder) {
    TriMesh mesh = generate(Shape::rock, 8000, 1);
    ASSERT_TRUE(repair(mesh));
    const auto indices = indices_of(mesh);
    const Fans fans(indices, static_cast<uint32_t>(mesh.wedge_count()));
    const CacheModel fifo16;
    const double plain = simulate(fifo16, drawn(indices, fan_order(fans, 16, {}))).atvr();
    const double ahead = simulate(fifo16, drawn(indices, fan_order(fans, 16, {}, {4, 60, 2}))).atvr();
    EXPECT_LT(plain, simulate(fifo16, tipsify(indices, fans.vertices, 16)).atvr());
    EXPECT_LT(ahead, plain);
    EXPECT_LT(ahead, 1.25);
}

TEST(KeyframeOrder, StaysNearAFreshOrderAtEveryLevelForTheMovesAllowed) {
    TriMesh mesh = generate(Shape::rock, 12000, 4);
    ASSERT_TRUE(repair(mesh));
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    ASSERT_TRUE(list);
    for (const double moves : {2.0, 8.0}) {
        SCOPED_TRACE(moves);
        OrderOptions options;
        options.moves_per_ecol = moves;
        const auto pm = bake_progressive_mesh(mesh, *list, {"keyframe", "static"}, options);
        ASSERT_TRUE(pm);
        const auto levels = sample_levels(*pm, 30, LevelSpacing::uniform);
        const OrderCost keyframe = cost_of_order(*pm, 0, options.cache, levels),
                        fixed = cost_of_order(*pm, 1, options.cache, levels);
        const double fresh = atvr_of_fresh_order(*pm, FreshOrder::meshoptimizer, options.cache, levels);
        EXPECT_LE(keyframe.moved_per_ecol, 1.05 * moves);
        EXPECT_LT(keyframe.atvr_mean, fixed.atvr_mean);
        EXPECT_LT(keyframe.atvr_mean, moves > 4 ? 0.97 * fresh : 1.02 * fresh);
        EXPECT_LT(keyframe.atvr_worst, moves > 4 ? 1.25 : 1.4);
        EXPECT_LT(keyframe.atvr_mean, moves > 4 ? 1.2 : 1.25);
    }
}

TEST(KeyframeOrder, CostsLittleOnAScan) {
    const std::string scan = "scans/laurana.ply";
    if (!fixtures::real_data(scan)) GTEST_SKIP() << fixtures::missing_data_note(scan);
    const TriMesh mesh = *fixtures::repaired_real_mesh(scan);
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    ASSERT_TRUE(list);
    const OrderOptions options;
    const auto pm = bake_progressive_mesh(mesh, *list, {"keyframe"}, options);
    ASSERT_TRUE(pm);
    const OrderCost cost = cost_of_order(*pm, 0, options.cache, sample_levels(*pm, 60, LevelSpacing::uniform));
    EXPECT_LT(cost.atvr_mean, 1.22);
    EXPECT_LT(cost.atvr_worst, 1.25);
    EXPECT_LE(cost.moved_per_ecol, options.moves_per_ecol);
}

TEST(FanOrder, LookingAheadAtALaterLevelCostsLessThere) {
    TriMesh mesh = generate(Shape::rock, 8000, 1);
    ASSERT_TRUE(repair(mesh));
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    ASSERT_TRUE(list);
    // A fifth of the vertices on the way to their kept ones.
    const auto indices = indices_of(mesh);
    std::vector<uint32_t> into(mesh.wedge_count());
    std::iota(into.begin(), into.end(), 0u);
    for (size_t i = 0; i < list->collapses.size() / 5; ++i) into[list->collapses[i].removed] = list->collapses[i].kept;
    std::vector<uint32_t> later;
    for (uint32_t v : indices) {
        while (into[v] != v) v = into[v];
        later.push_back(v);
    }
    const Fans fans(indices, static_cast<uint32_t>(mesh.wedge_count()));
    const CacheModel fifo16;
    const auto cost = [&](std::span<const uint32_t> level) {
        return count_transforms(fifo16, drawn(later, fan_order(fans, 16, {}, {4, 60, 2, level})), fans.vertices);
    };
    EXPECT_LT(cost(later), cost({}));
}

}  // namespace
}  // namespace lodestone
