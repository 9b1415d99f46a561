#include "lod/bake/orders/cluster_order.h"
#include "lod/bake/simplify/simplifier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "base/threads.h"
#include "fixtures/faces.h"
#include "fixtures/meshes.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/orders/order_statistics.h"
#include "mesh/generate.h"
#include "mesh/repair.h"

namespace lodestone {
namespace {

using fixtures::indices_of;

constexpr double whole[] = {1};

TEST(ClusterOrder, IsAPermutationOfAnyMeshDeadFacesIncluded) {
    for (const auto& f : fixtures::manifold_meshes()) {
        SCOPED_TRACE(f.name);
        std::vector<std::vector<uint32_t>> at{indices_of(f.mesh)};
        at[0].insert(at[0].end(), {0, 0, 1, 2, 2, 2});
        auto order = cluster_order(at, whole, static_cast<uint32_t>(f.mesh.wedge_count()), {32, 32, 12, true, 16});
        ASSERT_EQ(order.size(), at[0].size() / 3);
        std::ranges::sort(order);
        for (uint32_t i = 0; i < order.size(); ++i) ASSERT_EQ(order[i], i);
    }
}

TEST(ClusterOrder, FillsBatchesWithFewVerticesAndMoreSweepsFillThemBetter) {
    TriMesh mesh = generate(Shape::rock, 20000, 3);
    ASSERT_TRUE(repair(mesh));
    const std::vector<std::vector<uint32_t>> at{indices_of(mesh)};
    const CacheModel nvidia = *cache_model_named("nvidia");
    double before = 1e9;
    for (const uint32_t sweeps : {0u, 30u, 200u}) {
        ClusterOrderOptions options;
        options.sweeps = sweeps;
        const auto order = cluster_order(at, whole, static_cast<uint32_t>(mesh.wedge_count()), options);
        std::vector<uint32_t> drawn;
        for (const uint32_t f : order) drawn.insert(drawn.end(), &at[0][size_t{f} * 3], &at[0][size_t{f} * 3] + 3);
        size_t overfull = 0;
        for (size_t first = 0; first + 96 <= drawn.size(); first += 96)
            overfull += std::set<uint32_t>(drawn.begin() + static_cast<ptrdiff_t>(first),
                                           drawn.begin() + static_cast<ptrdiff_t>(first + 96))
                            .size() > 32;
        EXPECT_LE(overfull, 6u);  // at the very end
        const double atvr = simulate(nvidia, drawn).atvr();
        EXPECT_LT(atvr, before) << sweeps;
        before = atvr;
    }
}

TEST(ClusterOrder, GoesOnFromAnOrderBefore) {
    TriMesh mesh = generate(Shape::sphere, 20000, 3);
    ASSERT_TRUE(repair(mesh));
    std::vector<std::vector<uint32_t>> at{indices_of(mesh)};
    const auto vertices = static_cast<uint32_t>(mesh.wedge_count());
    ClusterOrderOptions few;
    few.sweeps = 30;
    const auto order = cluster_order(at, whole, vertices, few);
    std::vector<uint32_t> slots(order.size());
    for (uint32_t s = 0; s < order.size(); ++s) slots[order[s]] = s;
    const auto cost = [&](const std::vector<uint32_t>& o) {
        std::vector<uint32_t> drawn;
        for (const uint32_t f : o) drawn.insert(drawn.end(), &at[0][size_t{f} * 3], &at[0][size_t{f} * 3] + 3);
        return simulate(*cache_model_named("nvidia"), drawn).atvr();
    };
    EXPECT_LT(cost(cluster_order(at, whole, vertices, few, slots)), cost(order));
}

TEST(ClusterOrder, KeyframesServeBatchesAndAFifoAtOnceForAnyNumberOfThreads) {
    TriMesh mesh = generate(Shape::rock, 12000, 4);
    ASSERT_TRUE(repair(mesh));
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    ASSERT_TRUE(list);
    OrderOptions options;
    options.cache = *cache_model_named("nvidia");
    std::vector<uint32_t> first;
    for (const unsigned threads : {1u, 4u}) {
        set_thread_count(threads);
        const auto pm = bake_progressive_mesh(mesh, *list, {"keyframe"}, options);
        ASSERT_TRUE(pm);
        const PmCursor cursor(*pm);
        if (first.empty()) {
            first.assign(cursor.drawn_indices().begin(), cursor.drawn_indices().end());
            const auto levels = sample_levels(*pm, 30, LevelSpacing::uniform);
            const CacheModel fifo16;
            for (const CacheModel& model : {options.cache, fifo16}) {
                EXPECT_LT(cost_of_order(*pm, 0, model, levels).atvr_mean,
                          1.03 * atvr_of_fresh_order(*pm, FreshOrder::meshoptimizer, model, levels))
                    << name_of(model);
            }
        }
        EXPECT_TRUE(std::ranges::equal(first, cursor.drawn_indices())) << threads << " threads";
    }
    set_thread_count(0);
}

}  // namespace
}  // namespace lodestone
