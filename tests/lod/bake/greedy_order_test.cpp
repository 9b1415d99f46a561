#include "lod/bake/orders/greedy_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "fixtures/meshes.h"
#include "fixtures/real_data.h"
#include "lod/asset/cursor.h"
#include "lod/bake/bake.h"
#include "lod/bake/orders/order_statistics.h"
#include "lod/bake/simplify/simplifier.h"

namespace lodestone {
namespace {

ProgressiveMesh baked(const TriMesh& mesh, const OrderOptions& options = {},
                      const std::vector<std::string>& orders = {"greedy", "classic"}) {
    const auto list = make_quadric_simplifier()->simplify(mesh, {});
    EXPECT_TRUE(list);
    auto pm = bake_progressive_mesh(mesh, *list, orders, options);
    EXPECT_TRUE(pm) << pm.error().message;
    return std::move(*pm);
}

struct Baked {
    std::string name;
    ProgressiveMesh pm;  // orders greedy and classic
};
// Three generated shapes, and a scan where it is; baked once.
const std::vector<Baked>& all_baked() {
    static const std::vector<Baked> all = [] {
        std::vector<Baked> made;
        for (const auto& [name, shape] :
             {std::pair("rock", Shape::rock), std::pair("vase", Shape::vase), std::pair("torus", Shape::torus)})
            made.push_back({name, baked(fixtures::repaired(shape, 8000))});
        const std::string scan = "scans/laurana.ply";
        if (fixtures::real_data(scan)) {
            made.push_back({scan, baked(*fixtures::repaired_real_mesh(scan))});
        } else {
            std::cerr << fixtures::missing_data_note(scan) << "\n";
        }
        return made;
    }();
    return all;
}

OrderCost cost(const ProgressiveMesh& pm, uint32_t order, LevelSpacing spacing) {
    return cost_of_order(pm, order, OrderOptions{}.cache, sample_levels(pm, 60, spacing));
}

size_t slots_of(const FaceOrder& order, size_t step) {
    const size_t end = step + 1 < order.tswaps.size() ? order.tswaps[step + 1].first_slot : order.cycle_slots.size();
    return end - order.tswaps[step].first_slot;
}

TEST(GreedyOrder, CostsLittleAtEveryLevelForTheMovesAskedFor) {
    for (const auto& [name, pm] : all_baked()) {
        SCOPED_TRACE(name);
        for (const LevelSpacing spacing : {LevelSpacing::uniform, LevelSpacing::log}) {
            const OrderCost greedy = cost(pm, 0, spacing), classic = cost(pm, 1, spacing);
            EXPECT_LT(greedy.atvr_mean, 1.5);
            EXPECT_LT(greedy.atvr_mean, 0.45 * classic.atvr_mean);
            EXPECT_LE(greedy.moved_per_ecol, 8);
        }
        EXPECT_LT(cost(pm, 0, LevelSpacing::uniform).atvr_worst, 1.8);
    }
}

TEST(GreedyOrder, NoStepWritesMoreSlotsThanItsBound) {
    const auto check = [](const ProgressiveMesh& pm, uint32_t bound) {
        const FaceOrder& order = pm.orders[0];
        ASSERT_GT(order.tswaps.size(), 0u);
        for (size_t k = 0; k < order.tswaps.size(); ++k) ASSERT_LE(slots_of(order, k), bound) << "step " << k;
        // Indices written against the mean of all steps, with what an ecol itself writes.
        const double mean = static_cast<double>(order.corners.size() + 3 * order.cycle_slots.size()) /
                            static_cast<double>(pm.ecols.size());
        EXPECT_LT(3 * bound / mean, 20);
    };
    for (const auto& [name, pm] : all_baked()) {
        SCOPED_TRACE(name);
        check(pm, GreedyOptions{}.step);
    }
    OrderOptions options;
    options.greedy.step = 16;
    check(baked(fixtures::repaired(Shape::rock, 4000), options), 16);
}

TEST(GreedyOrder, TswapsDoTheWorkInMostGroups) {
    for (const auto& [name, pm] : all_baked()) {
        SCOPED_TRACE(name);
        const uint32_t group = GreedyOptions{}.group, groups = (pm.levels() - 1) / group;
        std::vector<bool> permutes(groups + 1, false);
        for (size_t k = 0; k < pm.orders[0].tswaps.size(); ++k) {
            if (slots_of(pm.orders[0], k) > 0) permutes[pm.orders[0].tswaps[k].level / group] = true;
        }
        EXPECT_GE(2 * std::ranges::count(permutes, true), groups);
    }
}

TEST(GreedyOrder, MostFacesKeepTheirSlotFromGroupToGroup) {
    const ProgressiveMesh pm = baked(fixtures::repaired(Shape::rock, 20000), {}, {"greedy"});
    PmCursor cursor(pm, 0);
    const uint32_t group = GreedyOptions{}.group;
    double kept = 0;
    uint32_t groups = 0;
    for (; groups < 40; ++groups) {
        std::vector<bool> written(cursor.slot_count(), false);
        const FaceOrder& order = pm.orders[0];
        for (size_t k = 0; k < order.tswaps.size(); ++k) {
            const uint32_t level = order.tswaps[k].level;
            if (level <= groups * group || level > (groups + 1) * group) continue;
            for (size_t i = 0; i < slots_of(order, k); ++i)
                written[order.cycle_slots[order.tswaps[k].first_slot + i]] = true;
        }
        kept += 1 - static_cast<double>(std::ranges::count(written, true)) / cursor.slot_count();
        cursor.goto_level((groups + 1) * group);
    }
    EXPECT_GT(kept / groups, 0.9);
}

TEST(GreedyOrder, MoreMovesGiveFewerTransforms) {
    const TriMesh mesh = fixtures::repaired(Shape::vase, 20000);
    double few = 0, many = 0;
    for (const double moves : {2.0, 8.0}) {
        OrderOptions options;
        options.moves_per_ecol = moves;
        const ProgressiveMesh pm = baked(mesh, options, {"greedy"});
        const OrderCost c = cost(pm, 0, LevelSpacing::uniform);
        EXPECT_LE(c.moved_per_ecol, moves * 1.1);
        (moves < 4 ? few : many) = c.atvr_mean;
    }
    EXPECT_LT(many, few - 0.03);
}

TEST(GreedyOrder, DeadSlotsWaitButNotTooMany) {
    for (const auto& [name, pm] : all_baked()) {
        SCOPED_TRACE(name);
        double most = 0;
        for (const uint32_t level : sample_levels(pm, 60, LevelSpacing::uniform)) {
            const uint32_t alive = pm.triangles_at(level);
            most = std::max(most, static_cast<double>(pm.orders[0].slots_at(level, alive)) / alive);
        }
        EXPECT_GT(most, 1.2);
        EXPECT_LT(most, 2.5);
    }
}

TEST(GreedyOrder, AHeavierWeightOfStayingInPlaceWritesLess) {
    const TriMesh mesh = fixtures::repaired(Shape::rock, 6000);
    OrderOptions light, heavy;
    light.greedy.in_place = light.greedy.line = 0;
    light.greedy.waiting = heavy.greedy.waiting = 3;
    heavy.greedy.in_place = 1;
    const auto moved = [&](const OrderOptions& options) {
        const ProgressiveMesh pm = baked(mesh, options, {"greedy"});
        return pm.orders[0].moved_per_ecol(pm.ecols.size());
    };
    EXPECT_LT(moved(heavy), moved(light));
}

}  // namespace
}  // namespace lodestone
